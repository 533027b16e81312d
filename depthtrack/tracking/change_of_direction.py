"""The change from forward to backward estimates in a stretch tracked in both directions."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import NamedTuple, Self

import numpy as np

from depthtrack.errors import InputError
from depthtrack.options import check_ranges, option
from depthtrack.tracking.configuration import HybridConfig, IkConfig, PsoConfig, TrackerConfig
from depthtrack.tracking.tracker import Estimate
from depthtrack.types import Array


@dataclass(frozen=True)
class BackwardOptions:
    """Stretches that are tracked backwards, and the choice between both directions."""

    doubtful: float = option(0.3, "A stretch with a pose of lower confidence is tracked backwards", most=1)
    confident: float = option(0.5, "Confidence of the poses before and after a stretch", most=1)
    confidence_weight: float = option(
        0.5,
        "Energy that a confidence of 1 makes up for",
        unit="clamp",
        source="tools/tune_backward.py on the tuning seeds 0 to 3 of the cross-model benchmark",
        most=100,
    )
    gain: float = option(
        0.05, "Energy by which a backward pose must be better", unit="clamp", source="as `confidence_weight`", most=100
    )
    motion_weight: float = option(
        20.0, "Energy of each metre that the keypoints move", unit="clamp/m", source="as `confidence_weight`", most=1000
    )
    pause: float = option(0.3, "Time between two frames beyond which a hand is not followed backwards", unit="s")

    def __post_init__(self) -> None:
        check_ranges(self)
        if self.doubtful > self.confident:
            raise InputError(f"doubtful must be at most confident, {self.confident:g}, found {self.doubtful:g}")


def chosen_backward(choice: bool | BackwardOptions | None, tracker: TrackerConfig) -> BackwardOptions | None:
    """Return the options of the backward pass; None for none.

    choice: whether there is one, or its options. By default, the trackers of papers go forward alone, and so does one
        with a deadline. A lift has no direction.

    Raises:
        InputError: the choice is of another type.
    """
    if isinstance(choice, BackwardOptions):
        return choice
    if choice is not None and not isinstance(choice, bool):
        raise InputError(f"backward must be true, false, absent or BackwardOptions, found {choice!r:.40}")
    if choice is None:
        choice = isinstance(tracker, HybridConfig | IkConfig | PsoConfig)
        choice = choice and getattr(tracker, "deadline", None) is None
    return BackwardOptions() if choice else None


class Motion(NamedTuple):
    """Mean distances that the keypoints of a stretch of N frames move, metres.

    Number n is the way from the frame before number n of the stretch to it. The last one leads to the anchor.

    forward: (N + 1,) between forward estimates.
    backward: (N + 1,) between backward estimates. The first one is not used.
    change: (N,) from forward to backward ones.
    """

    forward: Array
    backward: Array
    change: Array

    @classmethod
    def between(
        cls,
        forward: Sequence[Estimate],
        backward: Sequence[Estimate],
        ends: tuple[Estimate | None, Estimate],
        keypoints: Callable[[Array], Array],
    ) -> Self:
        """Return the motion in a stretch.

        ends: the estimates before it, None at the beginning of a recording, and after it.
        keypoints: returns those of a pose, metres.
        """

        def points(estimate: Estimate | None) -> Array | None:
            return None if estimate is None or estimate.pose is None else keypoints(estimate.pose)

        before, anchor = ends
        # An absent pose is the last one known in its direction.
        ahead = list(accumulate(map(points, (before, *forward)), _known))
        back = list(accumulate(map(points, (anchor, *reversed(backward))), _known))[::-1]
        return cls(
            np.array([_distance(*pair) for pair in pairwise([*ahead, back[-1]])]),
            np.array([_distance(*pair) for pair in pairwise([None, *back])]),
            np.array([_distance(*pair) for pair in zip(ahead[:-1], back[:-1], strict=True)]),
        )

    def totals(self) -> Array:
        """Return the length of the way (N + 1,) by the number of forward estimates that are kept."""
        ahead = np.concatenate([[0.0], np.cumsum(self.forward)])
        back = np.concatenate([np.cumsum(self.backward[::-1])[::-1], [0.0]])
        return np.append(ahead[:-2] + self.change + back[1:-1], ahead[-1])


def change_of_direction(
    forward: Sequence[Estimate],
    backward: Sequence[Estimate],
    motion: Motion,
    clamp: float,
    options: BackwardOptions,
) -> int:
    """Return the number of forward estimates to keep, so that the sum of the costs is least.

    The cost of an estimate is its energy, less a share for its confidence. Backward ones cost `gain` more: they must be
    clearly better. The way of the keypoints through the stretch costs too, so that a hand does not leap at the change.

    clamp: energy of a pixel that disagrees completely, `Objective.clamp`.
    """
    ahead = np.array([_cost(each, clamp, options) for each in forward])
    back = np.array([_cost(each, clamp, options) + options.gain for each in backward])
    before = np.concatenate([[0.0], np.cumsum(ahead)])
    after = np.concatenate([np.cumsum(back[::-1])[::-1], [0.0]])
    # Of equal sums the last one, which keeps most of the forward estimates.
    costs = before + after + options.motion_weight * motion.totals()
    return len(forward) - int(np.argmin(costs[::-1]))


def _cost(estimate: Estimate, clamp: float, options: BackwardOptions) -> float:
    """Return the cost of an estimate, in multiples of `clamp`; 1 without a pose."""
    if estimate.pose is None:
        return 1.0
    confidence = 0.0 if math.isnan(estimate.confidence) else estimate.confidence
    return min(estimate.energy / clamp, 1.0) - options.confidence_weight * confidence


def _known(before: Array | None, found: Array | None) -> Array | None:
    """Return what is found, or what was known before."""
    return before if found is None else found


def _distance(one: Array | None, other: Array | None) -> float:
    """Return the mean distance of keypoints, metres; 0 if some are unknown."""
    return 0.0 if one is None or other is None else float(np.linalg.norm(other - one, axis=1).mean())
