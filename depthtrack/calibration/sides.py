"""Calibration of a hand whose side is unknown.

Hands of average proportions of both sides, each of the scale that fits single frames best, are tracked over the
recording. If that leaves the side open, hands of both sides are calibrated. The energies of the last hands tracked for
that are compared. A few views alone leave the side open often: a hand of adapted sizes fits them from its back as well.
Such sizes are less common by the prior of the fit.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace

from depthtrack.calibration.calibrate import Calibration, calibrate, calibration_of
from depthtrack.calibration.first_scale import FirstHand, first_hand
from depthtrack.calibration.fitted_hand import FittedHand, fit_sizes, fit_skin
from depthtrack.calibration.joint_optimisation import size_covariance
from depthtrack.calibration.options import CalibrationOptions
from depthtrack.calibration.pose_search import Progress
from depthtrack.calibration.recorded_views import CalibrationSource
from depthtrack.errors import InputError
from depthtrack.hand.shape import Side
from depthtrack.hand.size_parameters import COUNT, size_deviation
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
    source = CalibrationSource(sequence, segmentation, seed, threads, frames, options or CalibrationOptions())
    report("size of the hand", 0.0)
    sides: tuple[Side, ...] = ("right", "left")
    scales = {side: first_hand(source, side).scale for side in sides}
    choice = choose_side(sequence, segmentation, threads, frames, side_options, _frames(report, 0.05, 0.2), scales)
    first = {side: FirstHand(scales[side], starts) for side, starts in choice.starts.items()}
    if choice.sure:
        views, part = choice.views.get(choice.side, ()), _part(report, 0.25, 0.75)
        found = calibrate(
            sequence, choice.side, views, segmentation, seed, threads, frames, part, options, first.get(choice.side)
        )
        return replace(found, side_margin=choice.margin, sure_margin=side_options.sure_margin)
    sized: dict[Side, FittedHand] = {}
    failure: InputError | None = None
    for n, side in enumerate(sides):
        try:
            part = _part(report, 0.25 + 0.25 * n, 0.25)
            sized[side] = fit_sizes(source, side, first[side], choice.views.get(side, ()), part)
        except InputError as error:
            failure = error
    if failure is not None:
        if not sized:
            raise failure
        return calibration_of(source, fit_skin(source, next(iter(sized.values())), _part(report, 0.75, 0.25)))
    side, margin = _cheaper(source, sized, choice)
    found = calibration_of(source, fit_skin(source, sized[side], _part(report, 0.85, 0.15)))
    # With an object in the hand, the average hands and those of adapted sizes often have different sides.
    return replace(found, side_margin=margin, side_agrees=side == choice.side)


def size_costs(deviations: Mapping[Side, float], options: CalibrationOptions) -> dict[Side, float]:
    """Return the factor of the sizes in the cost of each side.

    It is an inverse power of Student's t density of the sizes, with as many degrees of freedom. Only its ratio between
    the sides counts: two hands of equally uncommon sizes have about the same factor.

    deviations: squared, in standard deviations of the prior of `calibrate`, see `size_deviation`.
    """
    return {side: float((1 + each / COUNT) ** options.size_weight) for side, each in deviations.items()}


def _cheaper(source: CalibrationSource, sized: Mapping[Side, FittedHand], choice: SideChoice) -> tuple[Side, float]:
    """Return the side that costs less, and the share by which the other one costs more.

    choice: the comparison of the average hands.

    The cost of a side is a product of four figures: the mean energies of its last tracked hand and of its average
    hand, the median distance of its views, and the factor of its sizes. That distance is the one of their points to its
    skin. The first energy does not count if no frame shows both hands. Sizes of a wrong side may adapt well to the
    views, but are less common.
    """
    prior = size_covariance(source.options.joint)
    costs = size_costs(
        {side: size_deviation(each.values[:COUNT], prior) for side, each in sized.items()}, source.options
    )
    energies, frames = mean_energies({side: each.energies for side, each in sized.items()})
    for side, each in sized.items():
        costs[side] *= calibration_of(source, each).after_mm * (energies[side] if frames else 1.0)
        costs[side] *= 1.0 if side == choice.side else 1 + choice.margin
    side, other = sorted(sized, key=lambda each: costs[each])
    return side, costs[other] / costs[side] - 1


def _part(progress: Progress, begun: float, share: float) -> Progress:
    """Return the progress of a part of the work."""
    return lambda stage, done: progress(stage, begun + share * done)


def _frames(progress: Progress, begun: float, share: float) -> Callable[[int, int], None]:
    """Return the progress of a part of the work that tracks frames."""
    return lambda done, total: progress("side of the hand", begun + share * done / total)
