"""Writes the joints of a run in the format that a file's name asks for."""

from pathlib import Path

import numpy as np

from depthtrack.errors import InputError
from depthtrack.export.benchmark_joints import Benchmark
from depthtrack.export.csv_table import write_csv
from depthtrack.export.joint_track import JointTrack
from depthtrack.export.npz_arrays import write_npz
from depthtrack.export.uvd import write_uvd

SUFFIXES = (".csv", ".npz", ".txt")


def export_joints(path: Path, track: JointTrack, benchmark: Benchmark | None = None) -> None:
    """Write a track as `path`'s ending says: .csv, .npz, or .txt in the order of a `benchmark`. Raises InputError."""
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"joints are written to {', '.join(SUFFIXES)}, found '{path.name}'")
    if (suffix == ".txt") != (benchmark is not None):
        raise InputError("a .txt file needs the benchmark whose joints it lists, and no other file has one")
    if suffix == ".csv":
        write_csv(path, track)
    elif suffix == ".npz":
        write_npz(path, track)
    elif benchmark is not None:
        write_uvd(path, benchmark, benchmark_joints(track, benchmark))


def benchmark_joints(track: JointTrack, benchmark: Benchmark) -> np.ndarray:
    """Joints (N, J, 3), metres, a row for each frame of the recording up to the last one tracked; NaN without a pose.

    The text format counts lines: a frame that the run passed over must not shift all that follow.
    """
    frames = int(track.index.max()) + 1 if len(track.index) else 0
    joints = np.full((frames, len(benchmark.joints), 3), np.nan)
    joints[track.index] = benchmark.from_keypoints(track.keypoints)
    return joints
