"""Sizes of a hand measured while it is tracked: slow states beside the pose.

Views are kept from the frames that were tracked. Sizes and poses are optimised jointly in them, again and again, less
often when the sizes stay. Each time the poses come from a hand of better sizes, and the views are spread over a longer
time. Sizes as slow states with an uncertainty follow Tkach et al., "Online generative model personalization for hand
tracking", SIGGRAPH Asia 2017; the prior is that of `joint_optimisation`.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace

import numpy as np

from depthtrack.calibration.acceptance import check_resembles_hand
from depthtrack.calibration.calibrate import Measured, measured_sizes
from depthtrack.calibration.first_scale import best_scale
from depthtrack.calibration.fitted_hand import best_views, with_usual_proportions
from depthtrack.calibration.joint_optimisation import fit_jointly, size_covariance
from depthtrack.calibration.options import OngoingOptions
from depthtrack.calibration.residuals import CalibrationView
from depthtrack.calibration.solid_hands import nearest_solid
from depthtrack.errors import InputError
from depthtrack.hand.shape import HandShape, Side
from depthtrack.hand.size_parameters import COUNT, SCALE, WIDTHS, hand_of
from depthtrack.tracking.pipeline import TrackedFrame
from depthtrack.tracking.stretches import TrackedView
from depthtrack.tracking.tracker import Estimate, Tracker
from depthtrack.types import Array

MakeTracker = Callable[[HandShape], Tracker]
"""Returns a tracker of a hand."""


@dataclass(frozen=True)
class OngoingSizes:
    """Sizes of a hand so far.

    values: (35,) see `hand.size_parameters`.
    hand: hand of these sizes.
    measured: each length and width by name, with its standard deviation; empty before the first measurement.
    """

    values: Array
    hand: HandShape
    measured: Mapping[str, Measured]

    @classmethod
    def scaled(cls, side: Side, scale: float = 1.0) -> "OngoingSizes":
        """Return the average adult's sizes, or those of a hand of its proportions."""
        values = np.zeros(COUNT)
        values[SCALE] = np.log(scale)
        return cls(values, HandShape(side=side, scale=scale), {})

    def differs(self, other: "OngoingSizes", least: float) -> bool:
        """Return whether the scale or a length differs by at least `least`, in its logarithm."""
        return bool(np.abs(self.values - other.values)[: WIDTHS.start].max() >= least)


class KeptViews:
    """Trusted poses with their observations, evenly spread over the visible time."""

    def __init__(self, options: OngoingOptions) -> None:
        self._most, self._period, self._next = options.views, options.view_period, 0.0
        self.views: tuple[TrackedView, ...] = ()

    def add(self, tracked: TrackedFrame, visible: float) -> None:
        """Keep a tracked frame if a view is due. When they are full, drop every second.

        visible: time in which the hand was visible so far, s.
        """
        estimate, observation = tracked.estimate, tracked.observation
        if visible < self._next or observation is None or estimate.pose is None or not estimate.status.is_trusted:
            return
        # A copy holds neither the point cloud nor the whole frame.
        kept = replace(observation, silhouette=observation.silhouette.copy())
        self.views = (*self.views, TrackedView(kept, estimate.pose, estimate.energy, estimate.agreement))
        self._next = visible + self._period
        if len(self.views) == self._most:
            self.views, self._period = self.views[::2], 2 * self._period


def first_scale(views: Sequence[TrackedView], side: Side, make: MakeTracker, options: OngoingOptions) -> float:
    """Return the scale of the hand of average proportions that fits some views best.

    views: with poses of the average hand.

    Raises:
        InputError: if there are too few views.
    """
    if len(views) < options.fewest:
        raise InputError(f"comparing sizes needs at least {options.fewest} views of a hand, found {len(views)}")

    def fitted(scale: float) -> list[Estimate]:
        with closing(make(HandShape(side=side, scale=scale))) as tracker:
            return [tracker.start(view.observation, view.pose) for view in views]

    return best_scale(sorted(options.first_scales), fitted)[0]


def measure(views: Sequence[TrackedView], sizes: OngoingSizes, options: OngoingOptions) -> OngoingSizes:
    """Return the sizes of the hand in some views.

    sizes: those to start from, whose hand the poses belong to.

    Raises:
        InputError: if there are too few views, or they do not resemble a hand.
    """
    if len(views) < options.fewest:
        raise InputError(f"measuring needs at least {options.fewest} views of a hand, found {len(views)}")
    check_resembles_hand([each.agreement for each in views], options.accepted.hand_like)
    side, chosen = sizes.hand.side, best_views(views, options.accepted.good_views)
    observed, poses = [CalibrationView(each.observation) for each in chosen], np.stack([v.pose for v in chosen])
    fitted = fit_jointly(observed, poses, sizes.values, side, options.iterations, options=options.joint)
    values = nearest_solid(with_usual_proportions(fitted.values), side)
    hand = hand_of(values, side, "measured while it was tracked")
    return OngoingSizes(values, hand, measured_sizes(fitted.values, fitted.covariance, size_covariance(options.joint)))
