"""A user's own rigged hand as a skin: its joints give the `HandShape`, so that tracker and mesh agree.

The palm frame follows the rig: y from the wrist to the middle finger's knuckle, x across the knuckles, z out of the
palm. Bones that are no phalanges (wrist, metacarpals) belong to the palm, fingertips to the last phalanx; of a whole
body only the hand is kept.
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from depthtrack.errors import InputError
from depthtrack.files import read_text
from depthtrack.hand.kinematics import BODY_COUNT, body_of
from depthtrack.hand.pose import FINGERS
from depthtrack.hand.rig.gltf import Rig, read_rigs
from depthtrack.hand.rig.rig_joints import finger_joints, mapped_joints, side_of
from depthtrack.hand.rig.rig_measurement import bone_frames, measured_shape
from depthtrack.hand.shape import Side
from depthtrack.hand.skin.mesh import Skin
from depthtrack.types import Array, Index


def load_skin(
    path: Path, side: Side | None = None, mapping: Mapping[str, str] | Path | None = None, unit: float = 1.0
) -> Skin:
    """The skin of a rigged hand in a glTF file (.glb, .gltf); `skin.shape` holds the sizes measured on it.

    `side` where names and shape leave it open, or to choose one of two hands; `mapping` from `kinematics.JOINT_NAMES`
    to the rig's joint names, or a JSON file of it, where they are not recognised; `unit` metres per unit of the file
    (glTF means 1). The joints are the rig's own; each bone turns about our axes, so a rig whose joints do not lie in
    one plane a finger meets its bind pose up to that. Raises InputError for files, names and sizes that do not make
    a hand, MissingExtraError without pygltflib.
    """
    if isinstance(mapping, Path):
        mapping = _read_mapping(mapping)
    try:
        rig, phalanges = _rig_of_hand(read_rigs(path), side, mapping)
        wrist = _wrist(rig, phalanges, mapping)
        side = side or _side(rig, phalanges, wrist)
        return _skin(_hand_alone(rig, wrist), phalanges, wrist, side, unit, f"rigged mesh {path.name}")
    except InputError as error:
        raise error if str(path) in str(error) else InputError(f"{path}: {error}") from error


def _read_mapping(path: Path) -> Mapping[str, str]:
    try:
        mapping = json.loads(read_text(path))
    except (InputError, ValueError, RecursionError) as error:
        raise InputError(f"cannot read the joint mapping {path}: {error}") from error
    if not isinstance(mapping, dict) or not all(isinstance(joint, str) for joint in mapping.values()):
        raise InputError(f'{path} must be one JSON object like {{"index_0": "name in the rig", ...}}')
    return mapping


def _rig_of_hand(rigs: Iterable[Rig], side: Side | None, mapping: Mapping[str, str] | None) -> tuple[Rig, Index]:
    """The first rig with five fingers, and its phalanges (5, 3)."""
    for rig in rigs:
        try:
            if mapping is not None:
                return rig, mapped_joints(rig.names, mapping)
            loads = np.bincount(rig.bound.ravel(), rig.weights.ravel(), len(rig.names)).astype(np.float64)
            return rig, finger_joints(rig.names, rig.parents, loads, side)
        except InputError as error:
            last = error
    raise last


def _wrist(rig: Rig, phalanges: Index, mapping: Mapping[str, str] | None) -> int:
    """The joint at the wrist: as mapped, or the last one that all fingers hang on, or by name in a flat rig."""
    if mapping is not None and "wrist" in mapping:
        return rig.names.index(mapping["wrist"])
    above = [_ancestors(rig, int(joint)) for joint in phalanges[:, 0]]
    for joint in above[0]:
        if all(joint in others for others in above):
            return joint
    side = side_of(rig.names[phalanges[1, 0]])
    for joint, name in enumerate(rig.names):
        if "wrist" in name.lower() and side_of(name) in (None, side):
            return joint
    raise InputError('the rig has no joint that all fingers hang on: name it as "wrist" in a joint mapping')


def _ancestors(rig: Rig, joint: int) -> list[int]:
    above = []
    while (joint := int(rig.parents[joint])) >= 0:
        above.append(joint)
    return above


def _hand_alone(rig: Rig, wrist: int) -> Rig:
    """The rig without faces that other joints than the wrist's descendants move for the most part."""
    hand = np.array([joint == wrist or wrist in _ancestors(rig, joint) for joint in range(len(rig.names))])
    if hand.sum() < BODY_COUNT:  # a flat rig: nothing tells the hand from the rest
        return rig
    kept = np.sum(rig.weights * hand[rig.bound], axis=1) >= 0.5
    faces = rig.faces[kept[rig.faces].all(axis=1)]
    used = np.unique(faces)
    index = np.zeros(len(kept), dtype=np.int64)
    index[used] = np.arange(len(used))
    return replace(
        rig, vertices=rig.vertices[used], faces=index[faces], bound=rig.bound[used], weights=rig.weights[used]
    )


def _side(rig: Rig, phalanges: Index, wrist: int) -> Side:
    """From the names; else from the way the fingers bend and the thumb stands out, both towards the palm."""
    named = {side for joint in phalanges.ravel() if (side := side_of(rig.names[joint])) is not None}
    if len(named) == 1:
        return named.pop()
    first, second, third = (rig.joints[phalanges[:, k]] for k in range(3))
    palmar_if_right = _unit(np.cross(first[1] - first[4], first[2] - rig.joints[wrist]))
    bend = _unit(third - second) - _unit(second - first)
    evidence = float(np.sum(bend[1:] @ palmar_if_right) + _unit(third[0] - first[0]) @ palmar_if_right)
    if abs(evidence) < 0.2:
        raise InputError("neither names nor shape tell whether the hand is left or right: say which, side=...")
    return "right" if evidence > 0 else "left"


def _skin(rig: Rig, phalanges: Index, wrist: int, side: Side, unit: float, source: str) -> Skin:
    weights = _body_weights(rig, phalanges)
    points = np.empty((5, 4, 3))
    points[:, :3] = rig.joints[phalanges]
    for finger in range(5):
        points[finger, 3] = _tip(rig, int(phalanges[finger, 2]), points[finger], weights[:, body_of(finger, 2)], finger)
    _check_size(unit * np.linalg.norm(np.diff(points[2], axis=0, prepend=rig.joints[[wrist]]), axis=-1).sum(), unit)

    R, centre = _palm_frame(rig.joints[wrist], points, side)
    points, vertices = ((unit * (p - centre)) @ R.T for p in (points, rig.vertices))
    # Sizes are a right hand's: a left one is measured in the mirror.
    flip = np.array([1.0 if side == "right" else -1.0, 1, 1])
    shape = measured_shape(points * flip, vertices * flip, weights, source)
    mirror = np.diag([*flip, 1.0])
    T_palm_body = mirror @ bone_frames(shape, points * flip) @ mirror
    return Skin(shape.with_(side=side), vertices, rig.faces, weights, np.asarray(np.linalg.inv(T_palm_body)))


def _body_weights(rig: Rig, phalanges: Index) -> Array:
    """(V, 16): each joint's weight goes to the phalanx that it is or hangs on, else to the palm."""
    body = {int(joint): 1 + i for i, joint in enumerate(phalanges.ravel())}
    bodies = np.array(
        [next((body[j] for j in (joint, *_ancestors(rig, joint)) if j in body), 0) for joint in range(len(rig.names))]
    )
    weights = np.zeros((len(rig.vertices), BODY_COUNT))
    np.add.at(weights, (np.arange(len(weights))[:, None], bodies[rig.bound]), rig.weights)
    return weights


def _tip(rig: Rig, last: int, joints: Array, weights: Array, finger: int) -> Array:
    """The skin's furthest point (3,) along the last bone, whose direction a tip joint gives, or else the skin."""
    own = rig.vertices[weights >= 0.5] - joints[2]
    along = _unit(joints[2] - joints[1])
    if len(own) < 4 or np.max(own @ along) <= 0:
        raise InputError(f"the last joint of the {FINGERS[finger]}, {rig.names[last]!r}, moves no fingertip")
    children = [rig.joints[j] for j in np.nonzero(rig.parents == last)[0]]
    if last in rig.ends:
        children.append(rig.ends[last])
    towards = [d for child in children if (d := _unit(child - joints[2])) @ along > 0.7]
    reach = own @ along
    direction = towards[0] if towards else _unit(own[reach >= np.quantile(reach, 0.9)].mean(axis=0))
    return np.asarray(joints[2] + direction * np.max(own @ direction))


def _check_size(length: float, unit: float) -> None:
    if not 0.05 <= length <= 0.5:
        raise InputError(
            f"a hand must be 50 to 500 mm long from wrist to fingertip, found {length * 1000:.4g} mm with unit {unit:g}"
            f" m: give its unit of length (unit={0.18 / length * unit:.1g} may fit)"
        )


def _palm_frame(wrist: Array, points: Array, side: Side) -> tuple[Array, Array]:
    """Rotation (3, 3) from the rig's frame into the palm's, and the palm's centre (3,) in the rig's."""
    y = points[2, 0] - wrist
    across = points[1, 0] - points[4, 0] if side == "right" else points[4, 0] - points[1, 0]
    z = _unit(np.cross(across, y))
    return np.stack([np.cross(_unit(y), z), _unit(y), z]), wrist + y / 2


def _unit(v: Array) -> Array:
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    if np.any(length < 1e-12):
        raise InputError("two joints of the hand lie at the same place")
    return np.asarray(v / length)
