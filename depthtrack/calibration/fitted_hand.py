"""Sizes of a hand, and displacement of its skin, fitted to the views of a recording.

A hand of average proportions is tracked first. Sizes and poses are then optimised jointly in its views, and a hand of
these sizes is tracked in its place. Better sizes give better poses, and those give better sizes, until the sizes stay.
The third hand and later ones are not tracked: their poses are fitted from those of the views. The alternation follows
Tkach et al., "Online generative model personalization for hand tracking", SIGGRAPH Asia 2017, over a recording. At last
the displacement of the skin is fitted with the sizes, and the hand is tracked once more for that.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from depthtrack.calibration.first_scale import FirstHand
from depthtrack.calibration.joint_optimisation import fit_jointly
from depthtrack.calibration.pose_search import Progress
from depthtrack.calibration.recorded_views import CalibrationSource
from depthtrack.calibration.residuals import CalibrationView
from depthtrack.calibration.solid_hands import nearest_solid
from depthtrack.hand.displacement_grid import NODES
from depthtrack.hand.shape import HandShape, Side
from depthtrack.hand.size_parameters import COUNT, LENGTHS, PALM, SCALE, THUMB_BASE, WIDTHS, hand_of
from depthtrack.segmentation.observation import Observation
from depthtrack.tracking.stretches import Starts, TrackedView
from depthtrack.types import Array


@dataclass(frozen=True)
class FittedHand:
    """Sizes and poses that fit the views of a recording.

    The displacement of the skin follows the sizes if it was fitted.

    values, covariance: see `JointFit`.
    views: the views.
    poses: (V, 27) in them.
    energies: (N,) of the last hand that was tracked, in all tracked frames; NaN without a pose.
    starts: estimates of it to begin stretches with.
    """

    side: Side
    values: Array
    covariance: Array
    views: tuple[TrackedView, ...]
    poses: Array
    energies: Array
    starts: Starts


def fit_sizes(
    source: CalibrationSource, side: Side, first: FirstHand, views: Sequence[TrackedView], report: Progress
) -> FittedHand:
    """Return the sizes of the hand of a recording. Tracking and joint optimisation alternate.

    first: hand of average proportions to begin with.
    views: its poses; without them, it is tracked first.

    Raises:
        InputError: as `calibrate` does.
    """
    options, threads = source.options, source.threads
    values, rounds, joint, energies = np.zeros(COUNT), options.rounds, options.joint, np.zeros(0)
    values[SCALE], starts = np.log(first.scale), first.starts
    for number in range(rounds):
        hand = hand_of(values, side)
        if not views or number == 1:
            tracked = source.tracked(hand, _part(report, number / rounds, 0.6 / rounds), starts)
            energies, views, starts = tracked.energies, tracked.views, tracked.starts
        elif number > 0:
            views = source.refined(views, hand)
        source.check(views)
        report("fingers and palm", (number + 0.6) / rounds)
        rows = best_rows(views, options.accepted.good_views)
        chosen = [views[row] for row in rows]
        observed, poses = prepared(chosen, threads)
        fitted = fit_jointly(observed, poses, values, side, options.iterations, options=joint, threads=threads)
        found = nearest_solid(fitted.values, side)
        change, values = np.abs(found - values)[: WIDTHS.start].max(), found
        if number > 0 and change < options.converged:
            break
        poses_of = dict(zip(rows, fitted.poses, strict=True))
        views = [view._replace(pose=poses_of.get(row, view.pose)) for row, view in enumerate(views)]
    last = options.exact_iterations
    fitted = fit_jointly(observed, fitted.poses, values, side, last, exact=True, options=joint, threads=threads)
    return FittedHand(
        side, nearest_solid(fitted.values, side), fitted.covariance, tuple(chosen), fitted.poses, energies, starts
    )


def fit_skin(source: CalibrationSource, sized: FittedHand, report: Progress) -> FittedHand:
    """Return the hand with the displacement of its skin, fitted with the sizes.

    The skin is fitted in the views of the sizes first. Later rounds fit it in the poses of the hand found before.
    """
    options, fitted = source.options, sized
    values = np.concatenate([sized.values, np.zeros(NODES)])
    views, poses, starts = sized.views, sized.poses, sized.starts
    observed, _ = prepared(views, source.threads)
    for number in range(options.skin_rounds):
        begun = number / options.skin_rounds
        if number > 0:
            progress = _part(report, begun, 0.6 / options.skin_rounds)
            tracked = source.tracked(hand_of(values, sized.side), progress, starts)
            if len(tracked.views) < options.fewest:
                break
            views, starts = tuple(best_views(tracked.views, options.accepted.good_views)), tracked.starts
            observed, poses = prepared(views, source.threads)
        report("skin", begun + 0.6 / options.skin_rounds)
        iterations = options.skin_iterations
        fit = fit_jointly(
            observed,
            poses,
            values,
            sized.side,
            iterations,
            exact=True,
            options=options.joint,
            threads=source.threads,
        )
        values = nearest_solid(fit.values, sized.side)
        fitted = FittedHand(sized.side, values, fit.covariance, views, fit.poses, sized.energies, starts)
    return fitted


def prepared(views: Sequence[TrackedView], threads: int) -> tuple[list[CalibrationView], Array]:
    """Return views prepared for fits, and their poses (V, 27)."""
    with ThreadPoolExecutor(threads, "prepare") as pool:
        observed = list(pool.map(_prepared, [each.observation for each in views]))
    return observed, np.stack([each.pose for each in views])


def _prepared(observation: Observation) -> CalibrationView:
    """Return the view of an observation, which its fits share."""
    return observation.shared("calibration", lambda: CalibrationView(observation))


def best_views(views: Sequence[TrackedView], share: float) -> list[TrackedView]:
    """Return the share of the views with the lowest energies, at least two, in order."""
    return [views[row] for row in best_rows(views, share)]


def best_rows(views: Sequence[TrackedView], share: float) -> list[int]:
    """Return the rows of `best_views`."""
    order = np.argsort([each.energy for each in views], kind="stable")
    return sorted(order[: max(2, round(share * len(views)))].tolist())


def with_usual_proportions(values: Array) -> Array:
    """Return sizes (35,), or sizes and displacement, of the same hand with usual proportions.

    The median factor of fingers and palm moves into the scale.
    """
    parts = np.append(values[LENGTHS].reshape(5, 3).mean(axis=1), values[PALM][:2])
    common = float(np.median(parts))
    out = values.copy()
    out[0] += common
    out[1:24] -= common  # lengths, widths and palm
    out[24:] /= np.exp(common)  # bases of the fingers, and displacement of the skin
    # The factors of the palm do not move the base of the thumb out of the palm: its offset has to.
    height = HandShape().bases[0, 2]
    out[THUMB_BASE.stop - 1] += height / np.exp(common) - height
    return out


def _part(report: Progress, begun: float, share: float) -> Callable[[int, int], None]:
    """Return the progress of a part of the work that tracks frames."""
    return lambda done, total: report("poses of the hand", begun + share * done / total)
