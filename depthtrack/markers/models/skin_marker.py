"""Places of markers on the skin, in terms that fit a hand of any size.

A marker has a bone, a share of the bone's length and an angle about it. They define a ray from the bone.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from depthtrack.errors import InputError
from depthtrack.hand.kinematics import body_of
from depthtrack.hand.pose import FINGERS
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.implicit import ImplicitHand
from depthtrack.types import Array

BONES: Mapping[str, tuple[int, int]] = {
    f"{finger}_{bone}": (f, phalanx)
    for f, finger in enumerate(FINGERS)
    for phalanx, bone in (
        enumerate(("metacarpal", "proximal", "distal"))
        if finger == "thumb"
        else enumerate(("metacarpal", "proximal", "middle", "distal"), -1)
    )
}
"""Finger and phalanx of each bone; phalanx -1 is a metacarpal in the palm, which runs from the wrist to its knuckle."""


@dataclass(frozen=True)
class SkinMarker:
    """A marker on the skin.

    bone: one of `BONES`.
    along: share of the bone from its near end, 0 to 1.
    around: angle about the bone, radians; 0 is the back of the hand or the nail's side.
        It grows towards the side of the thumb; for the thumb, towards its palmar side.
    spread: standard deviation of the marker's position on a subject, metres, each axis.
    """

    label: str
    bone: str
    along: float
    around: float
    spread: float

    def __post_init__(self) -> None:
        if self.bone not in BONES:
            raise InputError(f"marker '{self.label}': the bone must be one of {', '.join(BONES)}, found {self.bone!r}")
        if not 0 <= self.along <= 1 or not abs(self.around) <= np.pi or not 0 <= self.spread <= 0.05:
            raise InputError(
                f"marker '{self.label}': along must lie between 0 and 1, around within 180 degrees, spread below 50 mm"
            )

    @property
    def body(self) -> int:
        """Body that the marker is fixed to, 0 to 15."""
        return body_of(*BONES[self.bone]) if BONES[self.bone][1] >= 0 else 0


def marker_place(shape: HandShape, body: int, point: Array) -> tuple[str, float, float] | None:
    """Return bone, share along it and angle about it (rad) of a point (3,) fixed to a body.

    shape: right hand of scale 1.
    point: metres, frame of the body.

    None if the point lies before or behind its bone, or all metacarpals. Of several metacarpals, the closest counts.
    """
    if body > 0:
        finger, phalanx = divmod(body - 1, 3)
        places = [(_name(finger, phalanx), np.zeros(3), np.eye(3), float(shape.lengths[finger, phalanx]))]
    else:
        places = []
        for finger in range(1, 5):
            root, knuckle = _carpal_root(shape, finger), shape.bases[finger]
            places.append((_name(finger, -1), root, _frame(knuckle - root), float(np.linalg.norm(knuckle - root))))
    best: tuple[float, tuple[str, float, float]] | None = None
    for name, start, axes, length in places:
        x, y, z = (point - start) @ axes
        distance = float(np.hypot(x, z))
        if 0 <= y <= length and (best is None or distance < best[0]):
            best = distance, (name, float(y / length), float(np.arctan2(x, -z)))
    return None if best is None else best[1]


def marker_ray(solid: ImplicitHand, marker: SkinMarker) -> tuple[Array, Array]:
    """Return the start (3,), metres, and direction (3,) of a marker's ray, palm frame at rest."""
    finger, phalanx = BONES[marker.bone]
    if phalanx >= 0:
        T = solid.bones[body_of(finger, phalanx)]
        start, axes = T[:3, 3] + marker.along * solid.shape.lengths[finger, phalanx] * T[:3, 1], T[:3, :3]
    else:
        root, knuckle = _carpal_root(solid.shape, finger), solid.shape.bases[finger]
        start, axes = root + marker.along * (knuckle - root), _frame(knuckle - root)
    return start, np.sin(marker.around) * axes[:, 0] - np.cos(marker.around) * axes[:, 2]


def _carpal_root(shape: HandShape, finger: int) -> Array:
    """Return the point (3,) at the wrist where a metacarpal begins, palm frame, metres."""
    return shape.wrist + np.array([(0.45, 0.15, -0.15, -0.45)[finger - 1] * shape.wrist_breadth / 2, 0, 0])


def _frame(axis: Array) -> Array:
    """Return the axes of a metacarpal as columns (3, 3): x to the thumb, y along it, z palmar."""
    y = axis / np.linalg.norm(axis)
    x = np.cross(y, [0, 0, 1])
    x /= np.linalg.norm(x)
    return np.stack([x, y, np.cross(x, y)], axis=-1)


def _name(finger: int, phalanx: int) -> str:
    return next(name for name, place in BONES.items() if place == (finger, phalanx))


def bone_length(hand: HandShape, bone: str) -> float:
    """Return the length of one of `BONES`, metres."""
    finger, phalanx = BONES[bone]
    if phalanx >= 0:
        return float(hand.lengths[finger, phalanx]) * hand.scale
    shape = hand.with_(side="right", scale=1.0)
    return float(np.linalg.norm(shape.bases[finger] - _carpal_root(shape, finger))) * hand.scale
