"""Read a user's rigged hand as a skinned mesh of 16 bodies, and measure its `HandShape`.

The palm frame follows the rig: y from the wrist to the middle finger's knuckle, x across the knuckles, z out of the
palm. Bones that are no phalanges (wrist, metacarpals) belong to the palm, fingertips to the last phalanx. Of a whole
body only the hand is kept. The joints are the rig's own. Each bone turns about the axes of `HandModel`: a rig whose
finger joints are not in one plane meets its bind pose only approximately.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from depthtrack.errors import InputError
from depthtrack.files import read_json, read_text
from depthtrack.hand.compiled_kinematics import BODY_COUNT
from depthtrack.hand.kinematics import body_of
from depthtrack.hand.pose import FINGERS
from depthtrack.hand.rig.closing import close_holes
from depthtrack.hand.rig.gltf import Rig, gltf_digest, read_rigs
from depthtrack.hand.rig.rig_joints import finger_joints, mapped_joints, side_of
from depthtrack.hand.rig.rig_measurement import bone_frames, measured_shape
from depthtrack.hand.rig_file import RigFile, Side
from depthtrack.hand.shape import HandShape
from depthtrack.types import Array, Faces, Index

_LENGTH = (0.05, 0.5)
"""Metres from wrist to middle fingertip that a hand may have: a factor of ten, so that one decimal unit fits."""
_DECIMAL_UNITS = (1.0, 0.1, 0.01, 0.001)
"""Units of length tried, metres: glTF's own, then those of programs that do not convert."""
_UNCLEAR_SIDE, _CLEAR_SIDE = 0.2, 0.5
"""Evidence for a side (sum of five sines) below which the shape does not show it, and above which it overrules names:
a mirrored node makes a left hand of joints named for the right."""


@dataclass(frozen=True)
class RiggedHand:
    """A user's rigged hand: see `hand.skin.mesh.Skin` for the arrays.

    `shape`: sizes measured on the mesh, with the reference to its file.
    """

    shape: HandShape
    rest: Array
    faces: Faces
    weights: Array
    T_body_rest: Array


def read_rigged_hand(path: Path, side: Side | None = None, unit: float | None = None) -> RiggedHand:
    """Read and measure the hand of a glTF file (.glb, .gltf).

    Joints that are not recognised by name are mapped by the file `NAME.joints.json` beside it: one JSON object from
    `kinematics.JOINT_NAMES` to the rig's joint names.

    `side`: the hand to read; found by names and shape if None.
    `unit`: metres per unit of the file; if None, the first decimal unit that gives a hand of usual length.

    Raises:
        InputError: if files, names or sizes do not make a hand.
        MissingExtraError: if pygltflib is not installed.
    """
    try:
        mapping = _read_mapping(path)
        rig, phalanges = _rig_of_hand(read_rigs(path), side, mapping)
        wrist = _wrist(rig, phalanges, mapping)
        return _measured(_hand_alone(rig, wrist), phalanges, wrist, _side(rig, phalanges, wrist, side), unit, path)
    except InputError as error:
        raise error if str(path) in str(error) else InputError(f"{path}: {error}") from error


def reread_rigged_hand(file: RigFile) -> RiggedHand:
    """Read a rigged hand again.

    Raises:
        InputError: if the file is missing, or is not the one that the reference was made for.
        MissingExtraError: if pygltflib is not installed.
    """
    found = rig_digest(file.path)
    if found != file.sha256:
        raise InputError(
            f"the rig {file.path} must have the SHA-256 {file.sha256[:12]}... of the hand measured on it, found "
            f"{found[:12]}...: restore the file, or give the new one with --hand"
        )
    return read_rigged_hand(file.path, file.side, file.unit)


def rig_digest(path: Path) -> str:
    """Return the SHA-256 of a rig: its glTF file, external buffers and joint mapping.

    Raises:
        InputError: if the file cannot be read or is not glTF.
    """
    digest, mapping = gltf_digest(path), mapping_path(path)
    return sha256((digest + read_text(mapping)).encode()).hexdigest() if mapping.exists() else digest


def mapping_path(path: Path) -> Path:
    """Return the path of the joint mapping that belongs to a glTF file."""
    return path.with_suffix(".joints.json")


def _read_mapping(rig: Path) -> Mapping[str, str] | None:
    path = mapping_path(rig)
    return read_json(path, "the joint mapping", _mapping) if path.exists() else None


def _mapping(fields: Any) -> Mapping[str, str]:
    if not isinstance(fields, dict) or not all(isinstance(joint, str) for joint in fields.values()):
        raise InputError('a joint mapping must be one JSON object like {"index_0": "name in the rig", ...}')
    return fields


def _rig_of_hand(rigs: Iterable[Rig], side: Side | None, mapping: Mapping[str, str] | None) -> tuple[Rig, Index]:
    """Return the first rig with five fingers, and its phalanges (5, 3)."""
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
    """Return the wrist joint: the mapped one, the last ancestor of all fingers, or one by name."""
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
    """Return the rig without faces moved mainly by joints above the wrist, its holes closed."""
    hand = np.array([joint == wrist or wrist in _ancestors(rig, joint) for joint in range(len(rig.names))])
    if hand.sum() >= BODY_COUNT:  # fewer in a flat rig, where the hierarchy does not separate the hand
        kept = np.sum(rig.weights * hand[rig.bound], axis=1) >= 0.5
        faces = rig.faces[kept[rig.faces].all(axis=1)]
        used = np.unique(faces)
        index = np.zeros(len(kept), dtype=np.int64)
        index[used] = np.arange(len(used))
        rig = replace(
            rig, vertices=rig.vertices[used], faces=index[faces], bound=rig.bound[used], weights=rig.weights[used]
        )
    return close_holes(rig)


def _side(rig: Rig, phalanges: Index, wrist: int, asked: Side | None) -> Side:
    """Return the side: the given one, or by the bend of fingers and thumb, or by joint names."""
    first, second, third = (rig.joints[phalanges[:, k]] for k in range(3))
    palmar_if_right = _unit(np.cross(first[1] - first[4], first[2] - rig.joints[wrist]))
    bend = _unit(third - second) - _unit(second - first)
    evidence = float(np.sum(bend[1:] @ palmar_if_right) + _unit(third[0] - first[0]) @ palmar_if_right)
    shown: Side = "right" if evidence > 0 else "left"
    if asked is not None:
        if asked != shown and abs(evidence) >= _CLEAR_SIDE:
            raise InputError(f"the rig must hold a {asked} hand as asked, found a {shown} one: leave the side out")
        return asked
    named = {side for joint in phalanges.ravel() if (side := side_of(rig.names[joint])) is not None}
    if len(named) == 1 and abs(evidence) < _CLEAR_SIDE:
        return named.pop()
    if abs(evidence) < _UNCLEAR_SIDE:
        raise InputError("neither names nor shape show whether the hand is left or right: give the side")
    return shown


def _measured(rig: Rig, phalanges: Index, wrist: int, side: Side, unit: float | None, path: Path) -> RiggedHand:
    weights = _body_weights(rig, phalanges)
    points = np.empty((5, 4, 3))
    points[:, :3] = rig.joints[phalanges]
    for finger in range(5):
        points[finger, 3] = _tip(rig, int(phalanges[finger, 2]), points[finger], weights[:, body_of(finger, 2)], finger)
    unit = _checked_unit(np.linalg.norm(np.diff(points[2], axis=0, prepend=rig.joints[[wrist]]), axis=-1).sum(), unit)

    R, centre = _palm_frame(rig.joints[wrist], points, side)
    points, vertices = ((unit * (p - centre)) @ R.T for p in (points, rig.vertices))
    # Sizes are a right hand's: a left one is measured in the mirror.
    flip = np.array([1.0 if side == "right" else -1.0, 1, 1])
    shape = measured_shape(points * flip, vertices * flip, weights, f"rigged mesh {path.name}")
    mirror = np.diag([*flip, 1.0])
    T_palm_body = mirror @ bone_frames(shape, points * flip) @ mirror
    shape = shape.with_(side=side, rig=RigFile(path.resolve(), rig_digest(path), side, unit))
    # As a hand file gives it back: the same sizes, to the last bit, whether read from the rig or from the file.
    shape = HandShape.from_fields(shape.to_fields())
    return RiggedHand(shape, vertices, rig.faces, weights, np.asarray(np.linalg.inv(T_palm_body)))


def _body_weights(rig: Rig, phalanges: Index) -> Array:
    """Return weights (V, 16): a joint's weight goes to its phalanx or ancestor, else the palm."""
    body = {int(joint): 1 + i for i, joint in enumerate(phalanges.ravel())}
    bodies = np.array(
        [next((body[j] for j in (joint, *_ancestors(rig, joint)) if j in body), 0) for joint in range(len(rig.names))]
    )
    weights = np.zeros((len(rig.vertices), BODY_COUNT))
    np.add.at(weights, (np.arange(len(weights))[:, None], bodies[rig.bound]), rig.weights)
    return weights


def _tip(rig: Rig, last: int, joints: Array, weights: Array, finger: int) -> Array:
    """Return the skin's farthest point (3,) along the last bone."""
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


def _checked_unit(length: float, unit: float | None) -> float:
    """Return the unit (m) that gives a hand of usual length."""
    for tried in _DECIMAL_UNITS if unit is None else (unit,):
        if _LENGTH[0] <= tried * length <= _LENGTH[1]:
            return tried
    raise InputError(
        f"a hand must be {_LENGTH[0] * 1000:.0f} to {_LENGTH[1] * 1000:.0f} mm long from wrist to fingertip, found "
        f"{(unit or 1.0) * length * 1000:.4g} mm: export it in metres, as glTF has it"
    )


def _palm_frame(wrist: Array, points: Array, side: Side) -> tuple[Array, Array]:
    """Return the rotation (3, 3) from the rig's to the palm frame, and the palm's centre (3,)."""
    y = points[2, 0] - wrist
    across = points[1, 0] - points[4, 0] if side == "right" else points[4, 0] - points[1, 0]
    z = _unit(np.cross(across, y))
    return np.stack([np.cross(_unit(y), z), _unit(y), z]), wrist + y / 2


def _unit(v: Array) -> Array:
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    if np.any(length < 1e-12):
        raise InputError("two joints of the hand lie at the same place")
    return np.asarray(v / length)
