"""Calibration of a hand whose side is unknown.

The average hands of both sides are tracked over the recording. If that leaves the side open, hands of both sides are
calibrated and tracked. A few views alone leave it open often: a hand of adapted sizes fits them from its back as well.
"""

from collections.abc import Callable
from collections.abc import Sequence as Views
from dataclasses import replace

from depthtrack.calibration.calibrate import Calibration, calibrate
from depthtrack.calibration.options import CalibrationOptions
from depthtrack.calibration.pose_search import Progress, ScorerFactory
from depthtrack.errors import InputError
from depthtrack.hand.shape import Side
from depthtrack.recording.sequence import Sequence
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.tracking.side_choice import SideOptions, choose_side, energies_of_sides


def calibrate_either_side(
    sequence: Sequence,
    views: Views[Observation],
    scorer: ScorerFactory,
    segmentation: SegmentationOptions | None = None,
    seed: int = 0,
    source: str = "calibrated",
    progress: Progress | None = None,
    options: CalibrationOptions | None = None,
) -> Calibration:
    """Return the calibration of a hand and its side.

    The arguments are those of `calibrate`.

    Raises:
        InputError: if the observations resemble a hand of neither side.
    """
    options = options or CalibrationOptions()
    report = progress or (lambda stage, share: None)
    sides_options = SideOptions()
    choice = choose_side(sequence, segmentation, options=sides_options, progress=_frames(report, 0.0, 0.25))
    if choice.sure:
        part = _part(report, 0.25, 0.75)
        measured = calibrate(views, scorer, choice.side, seed, source, part, options)
        return replace(measured, side_margin=choice.margin, sure_margin=sides_options.sure_margin)
    found: dict[Side, Calibration] = {}
    failure: InputError | None = None
    sides: tuple[Side, ...] = ("right", "left")
    for n, side in enumerate(sides):
        try:
            part = _part(report, 0.15 + 0.35 * n, 0.35)
            found[side] = calibrate(views, scorer, side, seed, source, part, options)
        except InputError as error:
            failure = error
    if failure is not None:
        if not found:
            raise failure
        return next(iter(found.values()))
    return _cheaper(sequence, found, segmentation, _frames(report, 0.85, 0.15))


def _cheaper(
    sequence: Sequence,
    found: dict[Side, Calibration],
    segmentation: SegmentationOptions | None,
    progress: Callable[[int, int], None],
) -> Calibration:
    """Return the calibration of the side that costs less.

    The cost of a side is the product of two figures: the mean energy while its hand is tracked, and the median distance
    of the views' points to its skin. The distance alone counts if no tracked frame shows a hand.
    """
    hands = {side: each.hand for side, each in found.items()}
    energies = energies_of_sides(sequence, hands, segmentation, progress=progress)
    shown = all(len(each) for each in energies.values())
    costs = {side: each.after_mm * (float(energies[side].mean()) if shown else 1.0) for side, each in found.items()}
    side, other = sorted(found, key=lambda each: costs[each])
    return replace(found[side], side_margin=costs[other] / costs[side] - 1)


def _part(progress: Progress, begun: float, share: float) -> Progress:
    """Return the progress of a part of the work."""
    return lambda stage, done: progress(stage, begun + share * done)


def _frames(progress: Progress, begun: float, share: float) -> Callable[[int, int], None]:
    """Return the progress of a part of the work that tracks frames."""
    return lambda done, total: progress("side of the hand", begun + share * done / total)
