"""Choose when backward poses of a doubtful stretch replace forward ones.

Usage: tune_backward.py FOLDER --rig RIG.glb [...] [--seeds N] [--frames N]

The recordings are those of the tuning seeds of the cross-model benchmark. Clips of them begin every half second, so
that some begin at a view that is hard to start from. `hybrid` tracks each with two hands: one with the joints of the
rig, and the average one. Each set of `confidence_weight`, `gain` and `motion_weight` is tried. Printed is the mean
joint error of the doubtful stretches. Numbers of stretches follow that improve, and that get worse, by 1 mm. An error
counts as at most 40 mm, and so does a missing pose. The folder holds the estimates, from which an interrupted choice
continues.
"""

import argparse
from collections.abc import Iterable, Iterator
from contextlib import closing
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from depthtrack.benchmarks.crossmodel.measure import WRONG, true_joints
from depthtrack.benchmarks.crossmodel.recordings import made_recording, recording_cells
from depthtrack.benchmarks.papers.experiment import ExperimentOptions
from depthtrack.evaluation.metrics.offsets import corrected_keypoints, joint_offsets
from depthtrack.evaluation.sweep.rows import Cell, Journal, Row
from depthtrack.evaluation.sweep.run import run_sweep
from depthtrack.evaluation.sweep.workers import chosen_workers
from depthtrack.hand.hand_file import load_hand
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.recording.sequence import Frame, Sequence
from depthtrack.recording.status import Status
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.solver.keypoints import fit_poses
from depthtrack.tracking.backward_options import BackwardOptions
from depthtrack.tracking.backward_pass import doubtful_stretches, motion_of, track_stretch
from depthtrack.tracking.change_of_direction import Motion, change_of_direction
from depthtrack.tracking.pipeline import Pipeline, track_frames
from depthtrack.tracking.registry import create_tracker, tracker_config
from depthtrack.tracking.tracker import ABSENT, Estimate
from depthtrack.types import Array

WEIGHTS, GAINS, MOTIONS = (0.25, 0.5, 1.0), (0.0, 0.05, 0.1, 0.15), (0.0, 1.0, 2.5, 5.0, 10.0, 20.0, 40.0)
WORST = 2e3 * WRONG
"""Millimetres: largest error of a frame."""
CLIP, EVERY = 45, 15
"""Frames of a clip, and between the beginnings of two."""
POSE = np.eye(27)[3]
"""Stands for any pose: the choice depends on energy, confidence and motion alone."""


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("--rig", nargs="+", required=True)
    arguments.add_argument("--seeds", type=int, default=4)
    arguments.add_argument("--frames", type=int, default=90)
    chosen = arguments.parse_args()
    options = ExperimentOptions(repetitions=chosen.seeds, frames=chosen.frames, rigs=tuple(chosen.rig), split="tuning")
    cells = recording_cells(options)
    with Journal(chosen.folder / "stretches.jsonl", list(cells[0])) as journal:
        rows = run_sweep(measure_stretches, cells, journal, chosen_workers(None))
    stretches = [np.array(stretch) for row in rows for stretch in row["stretches"]]
    forward = np.concatenate([stretch[:-1] for stretch in stretches])[:, 2]
    print(f"{len(rows)} recordings, {len(stretches)} stretches, {len(forward)} frames, {forward.mean():.2f} mm forward")
    for weight, gain, motion in product(WEIGHTS, GAINS, MOTIONS):
        options = BackwardOptions(confidence_weight=weight, gain=gain, motion_weight=motion)
        before, after = errors_with(stretches, options)
        worse, better = (after > before + 1).sum(), (after < before - 1).sum()
        lengths = np.array([len(each) - 1 for each in stretches])
        mean = float((after * lengths).sum() / lengths.sum())
        print(f"weight {weight} gain {gain} motion {motion}: {mean:.2f} mm, {better} better, {worse} worse")


def errors_with(stretches: list[Array], options: BackwardOptions) -> tuple[Array, Array]:
    """Return the mean error of each stretch, mm, forward and as the options choose."""
    before, after = [], []
    for stretch in stretches:
        ahead, back, moved = stretch[:-1, :3], stretch[:-1, 3:6], stretch[:, 6:].T
        motion = Motion(moved[0], moved[1], moved[2, :-1])
        found = ([_estimate(row) for row in part] for part in (ahead, back))
        change = change_of_direction(*found, motion, 1.0, options)
        before.append(ahead[:, 2].mean())
        after.append(np.concatenate([ahead[:change, 2], back[change:, 2]]).mean())
    return np.array(before), np.array(after)


def _estimate(row: Array) -> Estimate:
    """Return an estimate with the energy (in multiples of the clamp) and confidence of a row."""
    energy, confidence, _ = row.tolist()
    return ABSENT if confidence < 0 else Estimate(POSE, energy, 1.0, Status.TRACKED, {}, 0.0, confidence)


def measure_stretches(cell: Cell) -> Row:
    """Return the doubtful stretches of a recording.

    Each frame has energy, confidence and error, forward and then backward; confidence -1 stands for no pose. The three
    distances of `Motion` follow, metres. The last row of a stretch is that of its anchor.
    """
    with made_recording(**cell) as sequence:
        rig = load_hand(Path(cell["rig"]), cell["side"])
        hands = (replace(rig, scale=rig.scale * cell["scale"], rig=None), HandShape(side=rig.side))
        clips = [range(first, first + CLIP) for first in range(0, len(sequence) - CLIP + 1, EVERY)]
        return {"stretches": [each for hand in hands for clip in clips for each in _stretches(sequence, hand, clip)]}


def _stretches(sequence: Sequence, hand: HandShape, clip: range) -> list[Any]:
    """Return the stretches of a clip, frame by frame."""
    model, config, options = HandModel(hand), tracker_config("hybrid"), BackwardOptions()
    joints = np.array([true_joints(sequence, index) for index in range(len(sequence))])
    offsets, clamp = joint_offsets(model, fit_poses(model, joints).poses, joints), config.scoring.objective.clamp

    def row(estimate: Estimate, index: int) -> list[float]:
        if estimate.pose is None:
            return [1.0, -1.0, WORST]
        points = corrected_keypoints(model, estimate.pose[None], offsets)[0]
        error = 1e3 * float(np.linalg.norm(points - joints[index], axis=1).mean())
        return [estimate.energy / clamp, estimate.confidence, min(error, WORST)]

    def pipeline() -> Pipeline:
        return Pipeline(tracker, Segmenter.for_sequence(sequence), hand)

    with closing(create_tracker(config, hand)) as tracker:
        forward = [each.estimate for each in track_frames(sequence.frames(clip), pipeline())]
    stretches = doubtful_stretches(forward, options)
    rows = []
    with closing(create_tracker(config, hand)) as tracker:
        for stretch in reversed(stretches):

            def read(places: Iterable[int]) -> Iterator[Frame]:
                return sequence.frames(clip[place] for place in places)

            found = track_stretch(stretch, forward, read, pipeline())
            backward = {place: each.estimate for place, each in found}
            moved = motion_of(stretch, forward, backward, model.keypoints, options)
            both = backward | {stretch.anchor: forward[stretch.anchor]}
            places = range(stretch.first, stretch.anchor + 1)
            pairs = [[*row(forward[at], clip[at]), *row(both[at], clip[at])] for at in places]
            ways = zip(moved.forward.tolist(), moved.backward.tolist(), [*moved.change.tolist(), 0.0], strict=True)
            rows.append([[*pair, *way] for pair, way in zip(pairs, ways, strict=True)])
    return rows


if __name__ == "__main__":
    main()
