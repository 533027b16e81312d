"""Choose how starts are moved along the hand, and when doubtful ones try other places.

Usage: tune_starts.py FOLDER --rig RIG.glb [...] [--seeds N] [--every N]

The recordings are those of the tuning seeds of the cross-model benchmark. `hybrid` starts in single frames, at all
places of the hand, with two hands: one with the joints of the rig, and the average one. Each start is moved along the
hand too, and not bent. Each set of the options in `CHOICES` then chooses among these starts. Printed are the sets with
the fewest wrong starts, and the default one. A wrong start has a mean joint error of 20 mm; open and half-open hands
are counted apart. The number of other places that a start tries is that of further searches. The folder holds the
starts, from which an interrupted choice continues.
"""

import argparse
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

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
from depthtrack.recording.sequence import Sequence
from depthtrack.segmentation.observation import Resegmentation
from depthtrack.segmentation.options import DetectionOptions, SegmentationOptions
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.solver.keypoints import fit_poses
from depthtrack.tracking.guided_segmentation import segment_start
from depthtrack.tracking.options import TrackingThresholds
from depthtrack.tracking.registry import create_tracker, tracker_config
from depthtrack.tracking.stage_tracker import StageTracker
from depthtrack.tracking.start_choice import Start, is_doubtful, moved_along_hand, start_cost
from depthtrack.types import Array

CHOICES: dict[str, tuple[Any, ...]] = {
    "start_shifts": ((), (0.03,), (-0.03, 0.03), (-0.045, -0.03, 0.03, 0.045)),
    "start_confidence": (0.3, 0.4, 0.5, 0.7),
    "start_energy": (0.375, 0.5, 0.625, np.inf),
    "start_confidence_weight": (0.0, 0.5, 1.0),
    "place_cost": (0.0, 2.5, 5.0, 7.5),
    "alternative_cost": (0.12, 0.2, 0.3),
}
"""Values of each option; the last one belongs to the segmentation."""
FARTHEST = max(CHOICES["alternative_cost"])
SHIFTS = sorted({shift for shifts in CHOICES["start_shifts"] for shift in shifts})
WORST = 100.0
"""Energy of a pose without an observation around it, in multiples of the clamp."""
SHOWN = 10


class Moved(NamedTuple):
    """A start at one place of the hand.

    shift: by which it was moved along the hand, metres.
    error: mean joint error, metres.
    """

    start: Start
    shift: float
    error: float


class Trial(NamedTuple):
    """The starts of a single frame by places, the first ones at the place that is tried first.

    The first one of each place was not moved.
    """

    is_open: bool
    places: list[list[Moved]]


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("--rig", nargs="+", required=True)
    arguments.add_argument("--seeds", type=int, default=6)
    arguments.add_argument("--every", type=int, default=10)
    arguments.add_argument("--jobs", type=int)
    chosen = arguments.parse_args()
    chosen.folder.mkdir(parents=True, exist_ok=True)
    options = ExperimentOptions(repetitions=chosen.seeds, frames=90, rigs=tuple(chosen.rig), split="tuning")
    cells = [recording | {"every": chosen.every} for recording in recording_cells(options)]
    with Journal(chosen.folder / "places.jsonl", list(cells[0])) as journal:
        rows = run_sweep(measure_places, cells, journal, chosen_workers(chosen.jobs))
    trials = [trial for row in rows for trial in map(_trial, row["trials"])]
    print(f"{len(trials)} starts, {sum(trial.is_open for trial in trials)} of open hands")
    sets = [dict(zip(CHOICES, values, strict=True)) for values in product(*CHOICES.values())]
    counts = {number: wrong_starts(trials, each) for number, each in enumerate(sets)}
    best = sorted(counts, key=lambda number: counts[number])[:SHOWN]
    for number in best:
        print(_text(sets[number], counts[number]))
    defaults = vars(TrackingThresholds()) | vars(DetectionOptions())
    default = {name: defaults[name] for name in CHOICES}
    print("default:", _text(default, wrong_starts(trials, default)))


def wrong_starts(trials: list[Trial], options: dict[str, Any]) -> tuple[int, int, float]:
    """Return the numbers of wrong starts, of those of open hands, and of places tried by one."""
    farthest = options["alternative_cost"]
    thresholds = TrackingThresholds(**{name: value for name, value in options.items() if name != "alternative_cost"})
    shifts = {0.0, *thresholds.start_shifts}
    wrong = wrong_open = tried = 0

    def cost(each: Moved) -> float:
        return start_cost(each.start, thresholds)

    for trial in trials:
        starts = [min((each for each in place if each.shift in shifts), key=cost) for place in trial.places]
        best = starts[0] if starts else None
        if best is not None and is_doubtful(best.start, thresholds):
            near = [start for start in starts if start.start.place <= farthest]
            best, tried = min(near, key=cost), tried + len(near) - 1
        is_wrong = best is None or best.error >= WRONG
        wrong, wrong_open = wrong + is_wrong, wrong_open + (is_wrong and trial.is_open)
    return wrong, wrong_open, tried / len(trials)


def _text(options: dict[str, Any], counts: tuple[int, int, float]) -> str:
    wrong, wrong_open, tried = counts
    values = ", ".join(f"{name} {value}" for name, value in options.items())
    return f"{values}: {wrong} wrong, {wrong_open} of open hands, {tried:.2f} other places tried by one"


def _trial(row: list[Any]) -> Trial:
    is_open, places = row
    return Trial(
        is_open, [[Moved(Start(*figures), shift, error) for *figures, shift, error in place] for place in places]
    )


def measure_places(cell: Cell) -> Row:
    """Return the trials of a recording.

    Each start has the fields of `Start`, its shift and its error.
    """
    with made_recording(**{entry: cell[entry] for entry in cell if entry != "every"}) as sequence:
        rig = load_hand(Path(cell["rig"]), cell["side"])
        hands = replace(rig, scale=rig.scale * cell["scale"], rig=None), HandShape(side=rig.side)
        trials = (trial for hand in hands for trial in _trials(sequence, hand, cell["every"]))
        return {
            "trials": [
                [each.is_open, [[_figures(start) for start in place] for place in each.places]] for each in trials
            ]
        }


def _figures(moved: Moved) -> list[float]:
    return [*moved.start, moved.shift, moved.error]


def _trials(sequence: Sequence, hand: HandShape, every: int) -> Iterator[Trial]:
    model, truth = HandModel(hand), sequence.ground_truth
    assert truth is not None
    assert truth.poses is not None
    joints = np.array([true_joints(sequence, index) for index in range(len(sequence))])
    offsets = joint_offsets(model, fit_poses(model, joints).poses, joints)
    segmenter = Segmenter.for_sequence(sequence, _farther(SegmentationOptions()))
    with closing(create_tracker(tracker_config("hybrid"), hand)) as tracker:
        assert isinstance(tracker, StageTracker)
        for index in range(0, len(sequence), every):
            segmenter.reset()
            flexions = truth.poses[index][ANGLES].reshape(5, 4)[:, 1:]
            places = [
                [Moved(start, shift, _error(model, pose, offsets, joints[index])) for start, shift, pose in place]
                for place in _starts(sequence, segmenter, model, tracker, index)
            ]
            yield Trial(bool(flexions.mean() < HALF_OPEN), places)


def _starts(
    sequence: Sequence, segmenter: Segmenter, model: HandModel, tracker: StageTracker, index: int
) -> Iterator[list[tuple[Start, float, Array]]]:
    """Yield the starts of a frame at each place of the hand, with their shifts and poses (27,)."""
    first = segment_start(sequence[index], segmenter, model)
    if first is None or first.resegmentation is None:
        return
    for each in (first, *first.resegmentation.elsewhere()):
        pose = tracker.start(replace(each, resegmentation=None)).pose
        if pose is not None:
            poses = [(0.0, pose), *_moved(first.resegmentation, tracker, pose)]
            starts = [(tracker.start_at(at, each.cost, first.resegmentation), shift, at) for shift, at in poses]
            yield [(start._replace(energy=min(start.energy, WORST)), *moved) for start, *moved in starts]


def _moved(resegmentation: Resegmentation, tracker: StageTracker, pose: Array) -> Iterator[tuple[float, Array]]:
    """Yield the shifts of a pose (27,) along the hand, and the poses fitted there."""
    for shift in SHIFTS:
        moved = moved_along_hand(pose, shift)
        around = resegmentation.around(moved)
        found = None if around is None else tracker.start(replace(around, resegmentation=None), moved).pose
        if found is not None:
            yield shift, found


def _farther(options: SegmentationOptions) -> SegmentationOptions:
    """Return options whose starts try every place that a set may choose."""
    return replace(options, detection=replace(options.detection, alternative_cost=FARTHEST))


def _error(model: HandModel, pose: Array, offsets: Array, joints: Array) -> float:
    return float(np.linalg.norm(corrected_keypoints(model, pose[None], offsets)[0] - joints, axis=1).mean())


if __name__ == "__main__":
    main()
