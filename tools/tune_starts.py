"""Choose when and where doubtful starts try other places of the hand.

Usage: tune_starts.py FOLDER --rig RIG.glb [...] [--seeds N] [--every N] [--only OPTION ...]

The recordings are those of the tuning seeds of the cross-model benchmark. Each value is tried alone, the other options
have their defaults. Printed are the numbers of single-frame starts within 20 mm, and the mean CPU time of a start.
Open and half-open hands are counted apart. The hand has the joints of the rig, so that no calibration takes part.
The folder holds the counts, from which an interrupted choice continues.
"""

import argparse
import time
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from depthtrack.benchmarks.crossmodel.measure import HALF_OPEN, WRONG, true_joints
from depthtrack.benchmarks.crossmodel.recordings import made_recording, recording_cells
from depthtrack.benchmarks.papers.experiment import ExperimentOptions
from depthtrack.evaluation.metrics.offsets import corrected_keypoints, joint_offsets
from depthtrack.evaluation.sweep.rows import Cell, Journal, Row
from depthtrack.evaluation.sweep.run import run_sweep
from depthtrack.evaluation.sweep.workers import chosen_workers
from depthtrack.hand.hand_file import load_hand
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import ANGLES
from depthtrack.hand.shape import HandShape
from depthtrack.options import with_options
from depthtrack.recording.sequence import Sequence
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.solver.keypoints import fit_poses
from depthtrack.tracking.guided_segmentation import segment_start
from depthtrack.tracking.registry import create_tracker, tracker_config

CHOICES: dict[str, tuple[Any, ...]] = {
    "thresholds.start_confidence": (0.0, 0.3, 0.4, 0.6),
    "thresholds.place_cost": (0.0, 2.5, 5.0),
    "detection.alternative_cost": (0.08, 0.12, 0.2),
    "detection.alternative_shifts": ((), (0.04,), (0.04, 0.08)),
}
"""Values of each option, the default among them; those of `detection` belong to the segmentation."""
SETTING = ("options", "every")
"""Entries of a cell that are no arguments of `made_recording`."""


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("--rig", nargs="+", required=True)
    arguments.add_argument("--seeds", type=int, default=6)
    arguments.add_argument("--every", type=int, default=10)
    arguments.add_argument("--only", nargs="*", default=list(CHOICES))
    chosen = arguments.parse_args()
    chosen.folder.mkdir(parents=True, exist_ok=True)
    options = ExperimentOptions(repetitions=chosen.seeds, frames=90, rigs=tuple(chosen.rig), split="tuning")
    setting = {"options": ",".join(chosen.only), "every": chosen.every}
    cells = [recording | setting for recording in recording_cells(options)]
    with Journal(chosen.folder / "starts.jsonl", list(cells[0])) as journal:
        rows = run_sweep(count_starts, cells, journal, chosen_workers(None))
    for name in chosen.only:
        for value in CHOICES[name]:
            counts = np.array([row[_key(name, value)] for row in rows]).sum(axis=0)
            starts, right, is_open, open_right, seconds = counts.tolist()
            print(
                f"{name} {value}: {right:.0f} of {starts:.0f} right, {open_right:.0f} of {is_open:.0f} open hands, "
                f"{seconds / starts:.2f} s of CPU a start"
            )


def count_starts(cell: Cell) -> Row:
    """Return the counts of each value.

    They are starts, right ones, open hands, right ones of them, and seconds.
    """
    with made_recording(**{entry: cell[entry] for entry in cell if entry not in SETTING}) as sequence:
        rig = load_hand(Path(cell["rig"]), cell["side"])
        hand = replace(rig, scale=rig.scale * cell["scale"], rig=None)
        return {
            _key(name, value): _counts(sequence, hand, name, value, cell["every"])
            for name in cell["options"].split(",")
            for value in CHOICES[name]
        }


def _key(name: str, value: Any) -> str:
    return f"{name}={value}"


def _counts(sequence: Sequence, hand: HandShape, name: str, value: Any, every: int) -> list[float]:
    segmentation, config = SegmentationOptions(), tracker_config("hybrid")
    if name.startswith("detection."):
        segmentation = with_options(segmentation, {name: value})
    else:
        config = tracker_config("hybrid", **{name: value})
    model, truth, segmenter = HandModel(hand), sequence.ground_truth, Segmenter.for_sequence(sequence, segmentation)
    assert truth is not None
    assert truth.poses is not None
    joints = np.array([true_joints(sequence, index) for index in range(len(sequence))])
    offsets = joint_offsets(model, fit_poses(model, joints).poses, joints)
    indices = list(range(0, len(sequence), every))
    poses, begun = np.full((len(indices), 27), np.nan), time.process_time()
    with closing(create_tracker(config, hand)) as tracker:
        for row, index in enumerate(indices):
            segmenter.reset()
            observation = segment_start(sequence[index], segmenter)
            pose = None if observation is None else tracker.start(observation).pose
            if pose is not None:
                poses[row] = pose
    seconds = time.process_time() - begun
    errors = np.linalg.norm(corrected_keypoints(model, poses, offsets) - joints[indices], axis=2).mean(axis=1)
    flexions = truth.poses[indices][:, ANGLES].reshape(-1, 5, 4)[:, :, 1:].mean(axis=(1, 2))
    right, is_open = errors < WRONG, flexions < HALF_OPEN
    return [len(right), int(right.sum()), int(is_open.sum()), int((right & is_open).sum()), seconds]


if __name__ == "__main__":
    main()
