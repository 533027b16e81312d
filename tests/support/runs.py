"""Runs whose error is known: made from true poses, not by tracking."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthtrack.cli import main
from depthtrack.hand.shape import HandShape
from depthtrack.recording import open_sequence
from depthtrack.recording.run_folder import RunWriter
from depthtrack.recording.run_rows import RunRow
from depthtrack.recording.status import Status

STAGES = ("segment", "swarm")


def synthesise(folder: Path, frames: int = 6, *options: str) -> Path:
    """A short recording of a hand of spheres and cylinders by a perfect sensor."""
    assert main(["synth", "everyday", str(folder), "--frames", str(frames), *options]) == 0
    return folder


def true_poses(recording: Path) -> NDArray[np.float64]:
    """(T, 27)"""
    truth = open_sequence(recording).ground_truth
    assert truth is not None
    assert truth.poses is not None
    return truth.poses


def shifted(poses: NDArray[np.float64], mm: float, frames: slice = slice(None)) -> NDArray[np.float64]:
    """Return poses whose endpoint errors are exactly `mm`."""
    out = poses.copy()
    out[frames, 0] += mm / 1000
    return out


def write_run(
    folder: Path,
    recording: Path,
    poses: NDArray[np.float64],
    status: Mapping[int, str] | None = None,
    **configuration: Any,
) -> Path:
    """A run with these poses (T, 27); `status` by row where a frame is not plainly tracked."""
    sequence = open_sequence(recording)
    hand = sequence.hand or HandShape()
    settings = {
        "sequence": str(recording),
        "tracker": "pso",
        "camera": asdict(sequence.camera),
        "hand": json.loads(hand.to_json()),
        "skin_model": None,
        **configuration,
    }
    with RunWriter(folder, settings, STAGES) as run:
        for row, pose in enumerate(poses):
            said = (status or {}).get(row, "started" if row == 0 else "tracked")
            seen = said != "absent"
            energy, agreement = (2.0 + row, 0.9) if seen else (float("nan"), 0.0)
            time = float(sequence.timestamps[row])
            run.append(
                RunRow(row, time, Status(said), energy, agreement, pose if seen else None), {"segment": 4, "swarm": 16}
            )
    return folder
