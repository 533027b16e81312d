"""Calibration of a hand whose side is unknown.

The average hands of both sides are tracked over the recording. If that leaves the side open, hands of both sides are
calibrated. The energies of the last hands tracked for that are compared. A few views alone leave the side open often: a
hand of adapted sizes fits them from its back as well.
"""

from collections.abc import Callable
from dataclasses import replace

from depthtrack.calibration.calibrate import Calibration, calibrate
from depthtrack.calibration.options import CalibrationOptions
from depthtrack.calibration.pose_search import Progress
from depthtrack.errors import InputError
from depthtrack.hand.shape import Side
from depthtrack.recording.sequence import Sequence
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.tracking.side_choice import SideChoice, SideOptions, choose_side, mean_energies


def calibrate_either_side(
    sequence: Sequence,
    segmentation: SegmentationOptions | None = None,
    seed: int = 0,
    threads: int = 1,
    frames: int | None = None,
    progress: Progress | None = None,
    options: CalibrationOptions | None = None,
) -> Calibration:
    """Return the calibration of a hand and its side.

    The arguments are those of `calibrate`.

    Raises:
        InputError: if the observations resemble a hand of neither side.
    """
    report = progress or (lambda stage, share: None)
    side_options = SideOptions()
    choice = choose_side(sequence, segmentation, threads, frames, side_options, _frames(report, 0.0, 0.25))
    options = options or CalibrationOptions()

    def measured(side: Side, begun: float, share: float) -> Calibration:
        part = _part(report, begun, share)
        views = choice.views.get(side, ())
        return calibrate(sequence, side, views, segmentation, seed, threads, frames, part, options)

    if choice.sure:
        found = measured(choice.side, 0.25, 0.75)
        return replace(found, side_margin=choice.margin, sure_margin=side_options.sure_margin)
    calibrations: dict[Side, Calibration] = {}
    failure: InputError | None = None
    sides: tuple[Side, ...] = ("right", "left")
    for n, side in enumerate(sides):
        try:
            calibrations[side] = measured(side, 0.25 + 0.375 * n, 0.375)
        except InputError as error:
            failure = error
    if failure is not None:
        if not calibrations:
            raise failure
        return next(iter(calibrations.values()))
    return _cheaper(calibrations, choice)


def _cheaper(calibrations: dict[Side, Calibration], choice: SideChoice) -> Calibration:
    """Return the calibration of the side that costs less.

    choice: the comparison of the average hands.

    The cost of a side is a product of three figures: the mean energy of its last tracked hand, that of its average
    hand, and the median distance of the views' points to its skin. The first one does not count if no frame shows both
    hands.
    """
    energies, frames = mean_energies({side: each.energies for side, each in calibrations.items()})
    costs = {side: each.after_mm * (energies[side] if frames else 1.0) for side, each in calibrations.items()}
    costs = {side: cost if side == choice.side else cost * (1 + choice.margin) for side, cost in costs.items()}
    side, other = sorted(calibrations, key=lambda each: costs[each])
    return replace(calibrations[side], side_margin=costs[other] / costs[side] - 1)


def _part(progress: Progress, begun: float, share: float) -> Progress:
    """Return the progress of a part of the work."""
    return lambda stage, done: progress(stage, begun + share * done)


def _frames(progress: Progress, begun: float, share: float) -> Callable[[int, int], None]:
    """Return the progress of a part of the work that tracks frames."""
    return lambda done, total: progress("side of the hand", begun + share * done / total)
