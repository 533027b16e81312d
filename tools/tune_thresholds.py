"""Choose thresholds of the trackers on the tuning seeds of the cross-model benchmark.

Usage: tune_thresholds.py FOLDER [--rig RIG.glb ...] [--seeds N] [--frames N] [--tracker NAME] [--only OPTION ...]

Each threshold takes a few values about its default, the others keep theirs. A trusted frame costs its mean joint error
after removing offsets, at most 40 mm; a frame without a trusted pose costs 20 mm. Another value is recommended if its
cost is lower by more than the standard error over the recordings. Hands are calibrated once. The folder holds the
recordings, hands and costs, from which an interrupted choice continues.
"""

import argparse
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from depthtrack.benchmarks.crossmodel.measure import WRONG, true_joints
from depthtrack.benchmarks.crossmodel.recordings import made_recording, recording_cells
from depthtrack.benchmarks.papers.experiment import ExperimentOptions
from depthtrack.calibration.sides import calibrate_either_side
from depthtrack.evaluation.metrics import without_offsets
from depthtrack.evaluation.sweep.rows import Cell, Journal, Row
from depthtrack.evaluation.sweep.run import run_sweep
from depthtrack.evaluation.sweep.workers import chosen_workers
from depthtrack.files import write_atomic
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.recording.sequence import Sequence
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.tracking.pipeline import Pipeline, track_frames
from depthtrack.tracking.registry import create_tracker, tracker_config
from depthtrack.types import Array

THRESHOLDS: dict[str, tuple[float, ...]] = {
    "thresholds.confidence": (0.0, 0.01, 0.025, 0.05, 0.1),
    "thresholds.lost_ratio": (1.6, 2.0, 2.6),
    "thresholds.sure_confidence": (0.2, 0.3, 0.5, 1.0),
    "thresholds.doubt_confidence": (0.0, 0.15, 0.25, 0.35),
    "thresholds.doubt_margin": (0.0, 0.05, 0.1),
    "recovery.good_energy": (0.15, 0.2, 0.25),
    "recovery.accept_local": (0.88, 0.93, 0.97),
    "recovery.accept_global": (0.65, 0.75, 0.85),
    "recovery.accept_finger": (0.95, 0.98, 0.99),
    "recovery.accept_hidden": (0.7, 0.8, 0.9, 0.98),
    "recovery.accept_shift": (0.8, 0.9, 0.98),
    "recovery.doubt_energy": (0.25, 0.3, 0.4),
    "fit.icp.posture_weight": (1e-4, 3e-4, 1e-3),
    "scoring.objective.posture_weight": (0.0, 0.02, 0.04, 0.08),
    "scoring.objective.surroundings_depth": (0.01, 0.02, 0.03, 10.0),
    "branches.admit": (1.15, 1.3, 1.5),
    "branches.accept_at_once": (0.65, 0.75, 0.85),
    "branches.accept": (0.88, 0.93, 0.97),
}
"""Values of each threshold to try beside the default."""
SETTING = ("folder", "tracker", "option", "value")
"""Entries of a cell that are no arguments of `made_recording`."""
WORST = 2 * WRONG
"""Metres: largest cost of a trusted frame."""


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("--rig", nargs="*", default=[])
    arguments.add_argument("--seeds", type=int, default=2)
    arguments.add_argument("--frames", type=int, default=90)
    arguments.add_argument("--tracker", default="hybrid")
    arguments.add_argument("--only", nargs="*", default=list(THRESHOLDS))
    chosen = arguments.parse_args()
    chosen.folder.mkdir(parents=True, exist_ok=True)
    options = ExperimentOptions(repetitions=chosen.seeds, frames=chosen.frames, rigs=tuple(chosen.rig), split="tuning")
    values = {name: sorted({*THRESHOLDS[name], _default(chosen.tracker, name)}) for name in chosen.only}
    settings = [(name, value) for name in chosen.only for value in values[name]]
    cells = [
        recording | {"folder": str(chosen.folder), "tracker": chosen.tracker, "option": name, "value": value}
        for recording in recording_cells(options)
        for name, value in settings
    ]
    with Journal(chosen.folder / f"costs-{chosen.tracker}.jsonl", list(cells[0])) as journal:
        rows = run_sweep(measure_cost, cells, journal, chosen_workers(None))
    for name in chosen.only:
        costs = {value: _costs(rows, name, value) for value in values[name]}
        print(_recommendation(name, _default(chosen.tracker, name), costs))


def measure_cost(cell: Cell) -> Row:
    """Return the mean cost of the frames, mm, and the share without a trusted pose."""
    folder, tracker, option, value = (cell[name] for name in SETTING)
    recording = {name: entry for name, entry in cell.items() if name not in SETTING}
    with made_recording(**recording) as sequence:
        hand = calibrated_hand(Path(folder), recording, sequence)
        config = tracker_config(tracker, **{option: value})
        joints = np.array([true_joints(sequence, index) for index in range(len(sequence))])
        poses, trusted = np.full((len(sequence), 27), np.nan), np.zeros(len(sequence), dtype=np.bool_)
        with closing(create_tracker(config, hand)) as opened:
            for each in track_frames(sequence, Pipeline(opened, Segmenter.for_sequence(sequence), hand)):
                if each.estimate.pose is not None:
                    poses[each.frame.index] = each.estimate.pose
                    trusted[each.frame.index] = each.estimate.status.is_trusted
    errors = np.linalg.norm(without_offsets(HandModel(hand), poses, joints) - joints, axis=2).mean(axis=1)
    costs = np.where(trusted, np.minimum(errors, WORST), WRONG)
    return {"cost_mm": 1e3 * float(costs.mean()), "untrusted": float((~trusted).mean())}


def calibrated_hand(folder: Path, recording: Cell, sequence: Sequence) -> HandShape:
    """Return the hand measured on a recording; it is measured if its file is missing."""
    path = folder / f"hand-{recording['motion']}-{recording['seed']}-{len(sequence)}.json"
    if not path.exists():
        write_atomic(path, calibrate_either_side(sequence).hand.to_json())
    return HandShape.from_json(path)


def _default(tracker: str, name: str) -> float:
    value: Any = tracker_config(tracker)
    for part in name.split("."):
        value = getattr(value, part)
    return float(value)


def _costs(rows: list[Row], name: str, value: float) -> Array:
    """Return the cost of each recording, mm."""
    return np.array([row["cost_mm"] for row in rows if row["option"] == name and row["value"] == value])


def _recommendation(name: str, default: float, costs: dict[float, Array]) -> str:
    """Return a line with the mean costs, and the value to use."""
    usual = costs[default]
    best = min(costs, key=lambda value: float(costs[value].mean()))
    gain = usual - costs[best]
    significant = gain.mean() > gain.std(ddof=1) / np.sqrt(len(gain)) if best != default else False
    means = ", ".join(f"{value:g}: {cost.mean():.3f}" for value, cost in costs.items())
    return f"{name}: {means} mm; use {best if significant else default:g}"


if __name__ == "__main__":
    main()
