"""Export to BVH: a skeleton of the hand at rest, and a row of rotations at each time step.

Source: M. Meredith and S. Maddock, "Motion capture file formats explained", University of Sheffield CS-01-11, 2001.
"""

import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from depthtrack.errors import InputError
from depthtrack.export.axes import export_transform
from depthtrack.export.joint_track import JointTrack
from depthtrack.files import replace_atomically
from depthtrack.hand.kinematics import ENDPOINT_NAMES, HandModel
from depthtrack.hand.openxr_joints import R_BODY_JOINT
from depthtrack.hand.pose import retract, tangent_between
from depthtrack.hand.rest_rotations import JOINT_PARENTS, RestSkeleton
from depthtrack.types import Array

BVH_JOINTS = ("wrist", *(name for name in ENDPOINT_NAMES if not name.endswith("_tip")))
"""The 16 joints, thumb to little finger, each from the palm outward."""
_ORDER: Literal["YZX"] = "YZX"
"""Rotations about the axes of a joint, in turn.

A finger abducts about y and bends about x, so z, whose right angle is singular, stays near zero.
"""
_CENTIMETRES = 100.0
_MOST_ROWS = 1_000_000


def write(track: JointTrack, path: Path) -> None:
    """Write the skeleton and its motion, in centimetres and degrees.

    At rest the hand is flat, its fingers point along -z and its back to +y. BVH has one time step for all rows: rows
    are interpolated between the poses, and across frames without one.

    Raises:
        InputError: if no frame has a pose, the run is too long, or the file cannot be written.
    """
    track.check_posed()
    step, poses = evenly_timed(track.timestamps[track.posed], track.poses[track.posed])
    rest = RestSkeleton.of(HandModel(track.hand), R_BODY_JOINT)
    T = export_transform(track)
    rotations = rest.rotations(poses)
    rotations[:, 0] = T[:3, :3] @ rotations[:, 0]
    wrist = (rest.model.wrist(poses) @ T[:3, :3].T + T[:3, 3]) * _CENTIMETRES
    rows = np.concatenate([wrist, euler_angles(rotations).reshape(len(poses), -1)], axis=1)
    with replace_atomically(path) as temporary, temporary.open("w", encoding="ascii", newline="\n") as file:
        file.writelines(f"{line}\n" for line in _hierarchy(rest))
        file.write(f"MOTION\nFrames: {len(rows)}\nFrame Time: {step:.9g}\n")
        file.writelines(" ".join(f"{value:.6f}" for value in row) + "\n" for row in rows.tolist())


def evenly_timed(timestamps: Array, poses: Array) -> tuple[float, Array]:
    """Return the time step, s, and poses (R, 27) interpolated at even times.

    timestamps: (T,) of the poses, s.

    Raises:
        InputError: if times do not increase, or there were more than a million rows.
    """
    if len(poses) == 1:
        return 1 / 30, poses
    steps = np.diff(timestamps)
    if steps.min() <= 0:
        row = int(steps.argmin()) + 1
        raise InputError(
            f"the times of a run must increase, found {timestamps[row]:g} s after {timestamps[row - 1]:g} s"
        )
    count = round(float(timestamps[-1] - timestamps[0]) / float(np.median(steps)))
    if count >= _MOST_ROWS:
        raise InputError(f"a BVH file must have fewer than {_MOST_ROWS:,} rows of one time step, found {count:,}")
    times = np.linspace(timestamps[0], timestamps[-1], count + 1)
    before = np.clip(np.searchsorted(timestamps, times, side="right") - 1, 0, len(steps) - 1)
    share = ((times - timestamps[before]) / steps[before])[:, None]
    step = float(timestamps[-1] - timestamps[0]) / count
    return step, retract(poses[before], share * tangent_between(poses[before], poses[before + 1]))


def euler_angles(rotations: Array) -> Array:
    """Return the angles (T, J, 3) of rotations (T, J, 3, 3), degrees, without jumps."""
    with warnings.catch_warnings():
        # At the singularity the first and the last axis are the same; any split between them is right.
        warnings.simplefilter("ignore", UserWarning)
        angles = Rotation.from_matrix(rotations.reshape(-1, 3, 3)).as_euler(_ORDER)
    return np.asarray(np.degrees(np.unwrap(angles.reshape(*rotations.shape[:2], 3), axis=0)))


def _hierarchy(rest: RestSkeleton) -> Iterator[str]:
    yield "HIERARCHY"
    yield from _joint(rest, 0, 0)


def _joint(rest: RestSkeleton, joint: int, depth: int) -> Iterator[str]:
    """Yield the lines of a joint and of those after it, in the order of the channels."""
    indent = "\t" * depth
    offset = rest.offsets[joint] * _CENTIMETRES
    place = "6 Xposition Yposition Zposition" if joint == 0 else "3"
    yield f"{indent}{'JOINT' if depth else 'ROOT'} {BVH_JOINTS[joint]}"
    yield indent + "{"
    yield f"{indent}\tOFFSET {_numbers(offset)}"
    yield f"{indent}\tCHANNELS {place} {' '.join(f'{axis}rotation' for axis in _ORDER)}"
    after = [other for other, parent in enumerate(JOINT_PARENTS) if parent == joint]
    for other in after:
        yield from _joint(rest, other, depth + 1)
    if not after:
        tip = (rest.tips[(joint - 1) // 3] - rest.joints[joint]) * _CENTIMETRES
        yield f"{indent}\tEnd Site"
        yield f"{indent}\t{{"
        yield f"{indent}\t\tOFFSET {_numbers(tip)}"
        yield f"{indent}\t}}"
    yield indent + "}"


def _numbers(values: Array) -> str:
    return " ".join(f"{value:.6f}" for value in values.tolist())
