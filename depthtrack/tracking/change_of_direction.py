"""The change from forward to backward estimates in a stretch tracked in both directions."""

import math
from collections.abc import Callable, Sequence
from itertools import accumulate, pairwise
from typing import NamedTuple, Self

import numpy as np

from depthtrack.tracking.backward_options import BackwardOptions
from depthtrack.tracking.tracker import Estimate
from depthtrack.types import Array


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
