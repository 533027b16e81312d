"""The text format of public benchmarks: a line a frame, u v d (px, px, mm) of each joint.

Predictions and labels of NYU, ICVL and MSRA have this format (see `benchmark_joints`). Blanks or commas separate the
numbers; a file name may come first. An unknown joint is `nan nan nan`, or has no positive depth. MSRA's own
`joint.txt` has another format, x y z with negative z below a line with their count; `recording.sequences.msra15`
reads it.
"""

import math
from array import array
from pathlib import Path

import numpy as np

from depthtrack.errors import InputError
from depthtrack.export.joint_track import JointTrack
from depthtrack.files import read_lines, replace_atomically
from depthtrack.geometry.camera import Camera
from depthtrack.hand.benchmark_joints import Benchmark
from depthtrack.number_text import parse_number, parse_numbers
from depthtrack.recording.sequences.tum_lists import MAX_FRAMES
from depthtrack.types import Array

MAX_BYTES = 1 << 28
"""Largest file read, a hundred times the benchmarks' own."""
_NOT_UVD = "if it is a joint.txt of MSRA, with x y z and negative z, give its folder as --sequence instead"
_LARGEST = 1e6
"""Bound on coordinates, pixels or millimetres."""


def read_uvd(path: Path, benchmark: Benchmark) -> Array:
    """Return the joints (T, J, 3), metres, camera frame (y down), in the benchmark's order.

    Unknown joints are NaN.

    Raises:
        InputError: if a line does not have three numbers for each joint, or no depth is positive; it names the line.
    """
    values, frames = array("d"), 0
    for number, line in enumerate(read_lines(path, MAX_BYTES), start=1):
        fields = line.replace(",", " ").split()
        if not fields:
            continue
        if frames == 0 and len(fields) == 1 and fields[0].isdecimal():
            raise InputError(f"{path} begins with a number of frames: {_NOT_UVD}")
        values.extend(_numbers(fields, 3 * len(benchmark.joints), f"{path}, line {number}", benchmark))
        frames += 1
        if frames > MAX_FRAMES:
            raise InputError(f"{path} holds more than {MAX_FRAMES:,} frames: split it")
    if frames == 0:
        raise InputError(f"{path} must have a line of u v d for each frame, found none")
    uvd = np.array(values).reshape(frames, len(benchmark.joints), 3)
    _check_depths(path, uvd[..., 2])
    return _from_uvd(uvd, benchmark.camera)


def write(benchmark: Benchmark, track: JointTrack, path: Path) -> None:
    """Write a line for each frame of the recording, nan if it has no pose.

    The format counts lines, so a frame that the run skipped has a line too. The last line is the last tracked frame.

    Raises:
        InputError: if the file cannot be written.
    """
    frames = int(track.index.max()) + 1 if len(track.index) else 0
    joints = np.full((frames, len(benchmark.joints), 3), np.nan)
    joints[track.index] = benchmark.from_keypoints(track.keypoints)
    write_uvd(path, benchmark, joints)


def write_uvd(path: Path, benchmark: Benchmark, joints: Array) -> None:
    """Write joints (T, J, 3), metres, camera frame (y down), for the camera of the benchmark.

    Unknown joints and joints behind the camera become nan.

    Raises:
        InputError: if the file cannot be written.
    """
    with replace_atomically(path) as temporary, temporary.open("w", encoding="utf-8") as file:
        for frame in _to_uvd(joints, benchmark.camera):
            file.write(" ".join(f"{x:.3f}" for x in frame.ravel()) + "\n")


def _check_depths(path: Path, depths: Array) -> None:
    """Raise InputError if depths (T, J), mm, are known but none is positive."""
    known = depths[np.isfinite(depths)]
    if len(known) and not np.any(known > 0):
        raise InputError(
            f"{path} must hold u v d with depths above 0 mm, found {known.min():g} to {known.max():g} mm: {_NOT_UVD}"
        )


def _from_uvd(uvd: Array, camera: Camera) -> Array:
    depth = np.where(uvd[..., 2] > 0, uvd[..., 2] / 1000, np.nan)
    return camera.unproject(uvd[..., :2], depth)


def _to_uvd(joints: Array, camera: Camera) -> Array:
    pixels = camera.project(joints)
    depth = np.where(np.isfinite(pixels[..., 0]), 1000 * joints[..., 2], np.nan)
    return np.concatenate([pixels, depth[..., None]], axis=-1)


def _numbers(fields: list[str], count: int, where: str, benchmark: Benchmark) -> list[float]:
    if len(fields) == count + 1 and not _is_number(fields[0]):
        fields = fields[1:]  # the image's name
    if len(fields) != count or not all(map(_is_number, fields)):
        raise InputError(
            f"{where}: expected {count} numbers, u v d of the {count // 3} joints of {benchmark.name}, "
            f"found {len(fields)} fields beginning with {' '.join(fields)[:40]!r}"
        )
    found = parse_numbers(fields)
    if any(abs(x) > _LARGEST for x in found):
        raise InputError(
            f"{where}: expected pixels and millimetres up to {_LARGEST:g}, found {max(found, key=abs):.6g}"
        )
    return found


def _is_number(text: str) -> bool:
    """Return whether `text` is a finite number or nan."""
    try:
        return not math.isinf(parse_number(text))
    except ValueError:
        return False
