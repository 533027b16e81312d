"""The hand as an implicit solid: tapered capsules with smooth unions, webs and palm muscles.

All arrays are a right hand's of scale 1 in its rest pose, palm frame, metres. In that pose fingers are spread and half
bent: no two fingers touch, and each joint is near the middle of its range, where linear blend skinning is accurate.
Distances are negative inside, and exact enough near the surface for blending.

The numbers in the functions below are proportions, not measurements: each is a share of a size of `HandShape` (palm
length `unit`, palm thickness `thick`, a radius, a bone's length). So the solid scales with the hand. The sizes
have published sources, stated in `hand/shape.py`; the proportions have none and were set by hand. They serve three
ends, which tests/hand/skin/test_mesh.py checks. The surface passes through the measured sizes: radii at the joints,
palm and wrist thickness, fingertips. It is one closed solid with five free fingers, for hands of other sizes also. It
stays close to the spheres and cylinders of `hand/primitives.py`. Pads, mounts, thenar and hypothenar muscles and webs
are shaped for appearance within these bounds. A changed number moves the surface, and so the poses of surface fits.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from depthtrack.hand.compiled_kinematics import Chain
from depthtrack.hand.kinematics import body_of
from depthtrack.hand.pose import make_pose
from depthtrack.hand.reference_kinematics import reference_transforms
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.implicit_field import (
    Cone,
    ConeTable,
    Field,
    Web,
    WebTable,
    hand_distance,
    part_distances,
)
from depthtrack.types import Array

_FLEXION = np.radians([(0, 12, 18), (22, 34, 20), (22, 36, 20), (22, 36, 20), (22, 34, 20)])
_SPREAD = np.radians(10.0)


def rest_pose(shape: HandShape) -> Array:
    """Return the pose (27,) in which the skin is built, in the palm frame.

    Adjacent fingers spread by 10 degrees, or by more if they are too thick to stay apart.
    """
    angles = np.zeros((5, 4))
    angles[:, 1:] = _FLEXION
    lengths, thick, across = shape.lengths[1:, 0], shape.radii[1:], shape.bases[1:, 0]
    spread = np.full(3, _SPREAD)
    for t in (0.5, 1.0):  # halfway along the first phalanx and at its end
        radius = (1 - t) * thick[:, 0] + t * thick[:, 1]
        missing = radius[:-1] + radius[1:] + 0.04 * shape.palm_length + across[1:] - across[:-1]
        sideways = missing / (0.9 * t * (lengths[:-1] + lengths[1:]) / 2)
        spread = np.maximum(spread, np.arcsin(np.clip(sideways, 0, 0.7)))
    angles[1:, 0] = [spread[0], 0, -spread[1], -spread[1] - spread[2]]
    return make_pose(np.zeros(3), (1, 0, 0, 0), angles.ravel())


@dataclass(frozen=True)
class ImplicitHand:
    """The solid hand at rest; `bones` (16, 4, 4) are the rest transforms T_palm_body."""

    shape: HandShape
    bones: Array
    fingers: tuple[tuple[Cone, ...], ...]
    palm: tuple[tuple[Cone, ...], ...]
    muscles: tuple[Cone, ...]
    webs: tuple[Web, ...]

    @classmethod
    def of(cls, shape: HandShape) -> Self:
        """Return the solid of a right hand of scale 1 with the sizes of `shape`."""
        shape = shape.with_(side="right", scale=1.0)
        bones = reference_transforms(Chain.of(shape), rest_pose(shape))
        fingers = tuple(tuple(_finger(shape, bones, finger)) for finger in range(5))
        return cls(
            shape, bones, fingers, tuple(_palm(shape)), tuple(_muscles(shape, bones)), tuple(_webs(shape, bones))
        )

    @cached_property
    def _field(self) -> Field:
        unit, wrist = self.shape.palm_length, float(self.shape.wrist[1])
        return Field(
            ConeTable.of(self.palm),
            ConeTable.of([self.muscles]),
            WebTable.of(self.webs),
            ConeTable.of(self.fingers),
            0.1 * unit,
            0.12 * unit,
            0.07 * unit,
            0.25 * self.shape.radii[:, 3],
            np.array([0.12, 0.05, 0.05, 0.05, 0.05]) * unit,
            np.array([wrist, 0.02 * unit, 0.14 * unit]),
        )

    def distance(self, points: Array) -> Array:
        """Return the signed distance (N,) of points (N, 3) to the skin."""
        return np.asarray(hand_distance(self._field, np.ascontiguousarray(points)))

    def part_distances(self, points: Array) -> tuple[Array, Array]:
        """Return the signed distances of points (N, 3) to parts of the hand.

        They are the palm without muscles and webs (N,), and each finger alone (N, 5).
        """
        parts = part_distances(self._field, np.ascontiguousarray(points))
        return parts[0], np.ascontiguousarray(parts[1:].T)

    def bounds(self) -> tuple[Array, Array]:
        """Return the two corners (3,) of a bounding box of the hand."""
        # The palm's cones run on below the wrist, where they are cut off.
        whole = [*self.muscles, *(cone for finger in self.fingers for cone in finger)]
        low, high = _box([*whole, *(cone for ray in self.palm for cone in ray)])
        low[1] = min(_box(whole)[0][1], self.shape.wrist[1])
        margin = 0.1 * self.shape.palm_length
        return low - margin, high + margin


def _box(cones: list[Cone]) -> tuple[Array, Array]:
    ends = np.array([end for cone in cones for end in (cone.start, cone.end)])
    radii = np.array([radius for cone in cones for radius in (cone.radius_start, cone.radius_end)])[:, None]
    return (ends - radii).min(axis=0), (ends + radii).max(axis=0)


def _finger(shape: HandShape, bones: Array, finger: int) -> list[Cone]:
    cones = []
    for k in range(3):
        T = bones[body_of(finger, k)]
        r0, r1 = shape.radii[finger, k], shape.radii[finger, k + 1]
        length = shape.lengths[finger, k]
        if k == 2:
            length = max(length - r1, 1e-4)
        cones.append(_cone(T, (0, 0, 0), (0, length, 0), r0, r1))
        if (finger, k) != (0, 0):
            # The pad: a bulge on the palmar side between the joints.
            pad = 0.9 * min(r0, r1)
            cones.append(
                _cone(T, (0, 0.4 * length, 0.22 * r0), (0, (0.65 if k < 2 else 0.9) * length, 0.2 * r1), pad, pad)
            )
    return cones


def _palm(shape: HandShape) -> list[tuple[Cone, ...]]:
    wrist, unit, thick = shape.wrist, shape.palm_length, shape.palm_thickness
    knuckles, radii = shape.bases[1:], shape.radii[1:, 0]
    # The outer knuckles reach the breadth of the palm.
    left, right = knuckles[3, 0] - radii[3], knuckles[0, 0] + radii[0]
    stretch = shape.palm_breadth / (right - left)
    heads = knuckles + (knuckles - (left + right) / 2) * np.array([stretch - 1, 0, 0])
    wrist_radius = shape.wrist_thickness / 2
    spread = max(shape.wrist_breadth / 2 - wrist_radius, 0)
    rays: list[tuple[Cone, ...]] = []
    for head, radius, side in zip(heads, radii, (1.0, 0.35, -0.35, -1.0), strict=True):
        root = wrist + np.array([side * spread, 0.1 * unit, 0])
        waist = 0.4 * root + 0.6 * head
        rays.append(
            (Cone(root, waist, 0.78 * wrist_radius, 0.42 * thick), Cone(waist, head, 0.42 * thick, 0.95 * radius))
        )
    for side in (-1.0, 1.0):
        end = wrist + np.array([side * spread, -0.08 * unit, 0])
        rays.append((Cone(end - np.array([0, 0.2 * unit, 0]), end, wrist_radius, wrist_radius),))
    # The mounts: padding across the palmar side of the knuckles.
    mounts = heads + np.array([0, -0.06 * unit, 0.12 * thick])
    rays.append(tuple(Cone(mounts[i], mounts[i + 1], 0.33 * thick, 0.33 * thick) for i in range(3)))
    return rays


def _muscles(shape: HandShape, bones: Array) -> list[Cone]:
    unit, thick = shape.palm_length, shape.palm_thickness
    thumb, length = bones[body_of(0, 0)], shape.lengths[0, 0]
    little = shape.bases[4]
    wrist = shape.wrist
    carpus = wrist + np.array([0.06 * unit, 0.2 * unit, 0.2 * thick])
    thenar = Cone(carpus, _at(thumb, (-0.1 * length, 0.62 * length, 0.1 * length)), 0.42 * thick, 0.36 * thick)
    heel = np.array([0.55 * little[0], wrist[1] + 0.2 * unit, 0.16 * thick])
    edge = np.array([0.98 * little[0], little[1] - 0.2 * unit, 0.12 * thick])
    hypothenar = Cone(heel, edge, 0.42 * thick, 0.3 * thick)
    return [thenar, hypothenar]


def _webs(shape: HandShape, bones: Array) -> list[Web]:
    webs = []
    for finger in range(1, 4):
        radius = float(shape.radii[finger : finger + 2, 0].mean())
        # From behind the knuckles to a third of the first phalanges, a little to the palmar side.
        one, other = (
            np.stack([_at(bones[body_of(f, 0)], (0, t * shape.lengths[f, 0], 0.25 * radius)) for t in (-0.25, 0.33)])
            for f in (finger, finger + 1)
        )
        webs.append(Web(one, other, 0.6 * radius, 0.42 * radius))
    # Between thumb and index, the fold spans from metacarpal to metacarpal.
    length, knuckle, carpus = (
        shape.lengths[0, 0],
        shape.bases[1],
        shape.wrist + np.array([0.1, 0.15, 0]) * shape.palm_length,
    )
    thumb = np.stack([_at(bones[body_of(0, 0)], (0, t * length, 0)) for t in (0.35, 0.85)])
    index = np.stack([carpus + t * (knuckle - carpus) for t in (0.4, 0.75)])
    radius = 0.5 * float(shape.radii[1, 0])
    return [*webs, Web(thumb, index, radius, radius)]


def _cone(T: Array, start: tuple[float, ...], end: tuple[float, ...], radius_start: float, radius_end: float) -> Cone:
    return Cone(_at(T, start), _at(T, end), float(radius_start), float(radius_end))


def _at(T: Array, point: tuple[float, ...]) -> Array:
    return np.asarray(T[:3, :3] @ np.array(point) + T[:3, 3])
