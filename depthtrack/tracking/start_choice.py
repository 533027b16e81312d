"""The choice of a start among places of the hand.

A forearm can resemble a hand, and the segmentation without a prior may leave fingers out or include too much of the
forearm. So a start is judged in the region of interest of its own pose, as the next frame is: what the hand leaves
unexplained there counts.

Along the forearm, the energy of an observation without a prior hardly changes: the hand may slide there, with
stretched fingers in the place of its palm. So a start is also moved along the hand, and fitted there. Searches of
single fingers do not find that all are bent: a start with all fingers bent further is fitted too. A thumb behind the
palm is drawn to the edge of the silhouette: a start with the thumb opposed further is fitted as well. A doubtful start
tries other places of the hand, each with a search. Its confidence is also taken in its first observation: a hand on a
forearm may explain the region around it well, but not what was observed.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, NamedTuple, Protocol, TypeVar

from depthtrack.geometry.rotations import rotation_matrix
from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import ANGLES, ORIENTATION, POSITION
from depthtrack.segmentation.observation import Observation, Resegmentation
from depthtrack.tracking.candidate import Candidate
from depthtrack.tracking.options import TrackingThresholds
from depthtrack.types import Array


class Start(NamedTuple):
    """A start in the region of interest of its pose.

    energy: see `Estimate.comparable_energy`, in multiples of `Objective.clamp`.
    confidence: see `Confidence`.
    place: cost of the place of the hand, see `Observation.cost`, metres.
    """

    energy: float
    confidence: float
    place: float


class Proposal(Protocol):
    """A candidate that a start may be.

    confidence: in the observation that it was found in, see `Confidence`.
    place: cost of the place of the hand, see `Observation.cost`, metres.
    """

    @property
    def candidate(self) -> Candidate: ...

    @property
    def confidence(self) -> float: ...

    @property
    def place(self) -> float: ...


P = TypeVar("P", bound=Proposal)


@dataclass(frozen=True)
class StartChoice(Generic[P]):
    """Choice of the start that costs least.

    search: returns the best proposal in an observation, or None.
    refine: returns a pose (27,) fitted to an observation, or None.
    judge: returns the start of a pose (27,) at a place of some cost, see `StageTracker.start_at`.
    """

    thresholds: TrackingThresholds
    search: Callable[[Observation], P | None]
    refine: Callable[[Observation, Array], P | None]
    judge: Callable[[Array, float, Resegmentation], Start]

    def best(self, first: P, resegmentation: Resegmentation) -> P:
        """Return the best of a proposal and of those moved or bent.

        A doubtful one tries other places too.
        """
        thresholds = self.thresholds
        changes = thresholds.start_shifts or thresholds.start_bends or thresholds.start_oppositions
        if not (changes or tries_places(thresholds)):
            return first
        best, start = self._changed(first, resegmentation)
        if not is_doubtful(start, thresholds, first.confidence):
            return best
        for other in resegmentation.elsewhere():
            if (found := self.search(other)) is not None:
                found, there = self._changed(found, resegmentation)
                best, start = min((best, start), (found, there), key=self._cost)
        return best

    def _changed(self, first: P, resegmentation: Resegmentation) -> tuple[P, Start]:
        """Return the best of a proposal and of those that differ from it.

        They are moved, then bent, then have another thumb. Each is judged in the region of interest of its pose. The
        best one is fitted there too.
        """
        unchanged = best = first, self.judge(first.candidate.pose, first.place, resegmentation)
        for change, amounts in (
            (moved_along_hand, self.thresholds.start_shifts),
            (bent_further, self.thresholds.start_bends),
            (opposed_further, self.thresholds.start_oppositions),
        ):
            pose = best[0].candidate.pose
            for amount in amounts:
                found = self._fitted(change(pose, amount), first.place, resegmentation)
                best = best if found is None else min(best, found, key=self._cost)
        if best is unchanged:
            return best
        return self._fitted(best[0].candidate.pose, first.place, resegmentation) or best

    def _fitted(self, pose: Array, place: float, resegmentation: Resegmentation) -> tuple[P, Start] | None:
        """Return a pose (27,) fitted in the region of interest around it, or None."""
        around = resegmentation.around(pose)
        found = None if around is None else self.refine(around, pose)
        return None if found is None else (found, self.judge(found.candidate.pose, place, resegmentation))

    def _cost(self, proposed: tuple[P, Start]) -> float:
        return start_cost(proposed[1], self.thresholds)


def moved_along_hand(pose: Array, shift: float) -> Array:
    """Return a pose (27,) moved by `shift` (m) from the wrist towards the fingers."""
    moved = pose.copy()
    moved[POSITION] += shift * rotation_matrix(pose[ORIENTATION])[:, 1]
    return moved


def bent_further(pose: Array, angle: float) -> Array:
    """Return a pose (27,) with all joints of the four fingers bent by `angle` (rad).

    Angles stay within the limits.
    """
    bent = pose.copy()
    bent[ANGLES].reshape(5, 4)[1:, 1:] += angle
    return within_limits(bent)


def opposed_further(pose: Array, angle: float) -> Array:
    """Return a pose (27,) with all angles of the thumb increased by `angle` (rad).

    Palmar abduction is one of them. Angles stay within the limits.
    """
    opposed = pose.copy()
    opposed[ANGLES].reshape(5, 4)[0] += angle
    return within_limits(opposed)


def tries_places(thresholds: TrackingThresholds) -> bool:
    """Return whether any start tries other places."""
    return thresholds.start_confidence > 0 or thresholds.start_energy < float("inf")


def is_doubtful(start: Start, thresholds: TrackingThresholds, observed: float = 1.0) -> bool:
    """Return whether a start tries other places.

    observed: its confidence in the observation that it was found in. Its geometric mean with that of the start counts.
    """
    known = min(start.confidence, math.sqrt(start.confidence * observed))
    return known < thresholds.start_confidence or start.energy > thresholds.start_energy


def start_cost(start: Start, thresholds: TrackingThresholds) -> float:
    """Return the cost of a start, in multiples of `Objective.clamp`; the least one is chosen."""
    known = thresholds.start_confidence_weight * start.confidence
    return start.energy - known + thresholds.place_cost * start.place
