"""State of a track between frames.

It depends on the estimates alone, so that a run can be resumed.
"""

import math
from collections import deque
from collections.abc import Sequence
from statistics import median
from typing import NamedTuple

import numpy as np

from depthtrack.hand.pose import retract, tangent_between
from depthtrack.recording.branches import Branch
from depthtrack.recording.run_rows import UNKNOWN_SPREAD, UNKNOWN_VISIBILITY
from depthtrack.recording.status import Status
from depthtrack.tracking.candidate import Candidate
from depthtrack.tracking.options import TrackingThresholds
from depthtrack.tracking.tracker import Estimate
from depthtrack.types import Array

_SAME_TIME = 1e-6
"""Seconds: rounding of time stamps."""
_HALF_HAND = 0.1
"""Metres by which two poses of one palm differ at most, if one has another orientation."""
_ROUNDED = 0.01
"""Relative difference between the durations of two steps that counts as none."""


class InterruptedSearch(NamedTuple):
    """A search for the hand that its deadline interrupted, between two frames.

    turn: number of its rounds that are complete.
    waiting: (N, 27) poses that the round has not improved yet, best first.
    improved: (M, 27) poses that it has.
    centre: (3,) of the palm in the frame, metres, camera frame.
    """

    turn: int
    waiting: Array
    improved: Array
    centre: Array

    @staticmethod
    def put_off(centre: Array) -> "InterruptedSearch":
        """Return a search that the next frame begins."""
        return InterruptedSearch(0, np.empty((0, 27)), np.empty((0, 27)), centre)

    @property
    def has_begun(self) -> bool:
        """Whether there are poses to go on with."""
        return len(self.waiting) + len(self.improved) > 0


class TrackState:
    """Last pose, motion and energy of a track.

    pose: (27,) last pose, None if there is nothing to follow.
    energy: energy of the last pose.
    time: of the last pose, s; NaN if there was none.
    branches: alternatives to the last pose.
    lost: estimate of the last frame, if it was not trusted.
    last_trusted: (27,) last trusted pose that was not in doubt; None after `memory` seconds without one, in which a
        hand hardly turns over.
    search: search for the hand that the deadline of the last frame interrupted. A resumed run begins it anew.
    """

    def __init__(self, thresholds: TrackingThresholds, clamp: float, reconsiders: bool = True) -> None:
        """Make the state of no track.

        reconsiders: whether starts compete with a track in doubt; they take too long for a deadline.
        """
        self._thresholds, self._clamp, self._reconsiders = thresholds, clamp, reconsiders
        self._agreement, self._confidence = 0.0, math.nan
        self._energies: deque[float] = deque(maxlen=thresholds.median_frames)
        self.pose: Array | None = None
        self.energy = np.inf
        self.last_trusted: Array | None = None
        self.branches: tuple[Branch, ...] = ()
        self.search: InterruptedSearch | None = None
        self.time, self._trusted, self._started = math.nan, math.nan, math.nan
        self._motion, self._duration = np.zeros(26), math.nan
        self.lost: Estimate | None = None
        self._lost_since, self._doubted_since, self._previous = math.nan, math.nan, math.nan

    def is_lost(self, energy: float, agreement: float, confidence: float = math.nan) -> bool:
        """Return whether a pose with these figures is not trusted.

        confidence: NaN if unknown.
        """
        limits = self._thresholds
        if confidence < limits.confidence:
            return True
        most_energy = math.inf if confidence >= limits.sure_confidence else limits.energy
        return self.is_beyond(energy, agreement, most_energy, limits.agreement)

    def is_beyond(self, energy: float, agreement: float, most_energy: float, least_agreement: float) -> bool:
        """Return whether the agreement is too low or the energy too high.

        The energy is also compared with the median energy.

        most_energy: multiple of `Objective.clamp`.
        """
        if agreement < least_agreement:
            return True
        return energy > most_energy * self._clamp and energy > self._thresholds.lost_ratio * self.median_energy

    def is_jump(self, pose: Array, timestamp: float) -> bool:
        """Return whether no hand moves from the last pose to `pose` (27,) by `timestamp` (s)."""
        if self.pose is None:
            return False
        farthest = _HALF_HAND + self._thresholds.fastest * (timestamp - self.time)
        return bool(np.linalg.norm(pose[:3] - self.pose[:3]) > farthest)

    @property
    def median_energy(self) -> float:
        """Median energy of the last trusted poses; infinity before the first one."""
        return median(self._energies) if self._energies else np.inf

    def is_elevated(self, energy: float, ratio: float) -> bool:
        """Return whether an energy exceeds `ratio` times the median energy; always at ratio 0."""
        return ratio == 0 or energy > ratio * self.median_energy

    def commit(
        self,
        pose: Array,
        energy: float,
        agreement: float,
        status: Status,
        stage_ms: dict[str, float],
        timestamp: float = math.nan,
        confidence: float = math.nan,
        visibility: tuple[float, ...] = UNKNOWN_VISIBILITY,
        spread: tuple[float, ...] = UNKNOWN_SPREAD,
        branches: tuple[Branch, ...] = (),
        seen: Candidate | None = None,
        seen_energy: float = math.nan,
        may_jump: bool = False,
    ) -> Estimate:
        """Update the state with the next pose; return its estimate, lost if it is not trusted.

        seen: energy and agreement that decide this; those of the pose if None.
        seen_energy: see `Estimate`.
        may_jump: whether the pose may be anywhere, as a start that replaces a track.
        """
        judged = (energy, agreement) if seen is None else (seen.energy, seen.agreement)
        # Two doubtful frames are worth one that is certainly wrong.
        certain = math.sqrt(confidence * self._confidence) if status is Status.TRACKED else confidence
        if (not may_jump and self.is_jump(pose, timestamp)) or self.is_lost(*judged, certain):
            status = Status.LOST
        figures = confidence, visibility, spread, branches
        estimate = Estimate(pose, energy, agreement, status, stage_ms, timestamp, *figures, seen_energy=seen_energy)
        self.update(estimate)
        return estimate

    @property
    def is_new(self) -> bool:
        """Whether the last pose started the track."""
        return self.time == self._started

    def restore(self, estimates: Sequence[Estimate]) -> None:
        """Update the state with the estimates of earlier frames."""
        for estimate in estimates:
            self.update(estimate)

    def forget_last(self) -> None:
        """Remove the last pose and the energies, so that a new track may start anywhere."""
        self.pose, self.last_trusted = None, None
        self.lost, self._lost_since, self._doubted_since = None, math.nan, math.nan
        self._energies.clear()

    def update(self, estimate: Estimate) -> None:
        """Update the state with the estimate of the next frame."""
        elapsed = estimate.timestamp - self.time
        self._previous = estimate.timestamp
        if estimate.status is not Status.LOST:
            self._lost_since, self.lost = math.nan, None
        else:
            self.lost = estimate
            if math.isnan(self._lost_since):
                self._lost_since = estimate.timestamp
        if not (estimate.status.is_trusted and estimate.confidence < self._thresholds.doubt_confidence):
            self._doubted_since = math.nan
        elif math.isnan(self._doubted_since):
            self._doubted_since = estimate.timestamp
        if estimate.pose is None or estimate.status is Status.LOST:
            self.pose, self._motion, self.branches = None, np.zeros(26), ()
            if estimate.timestamp - self._trusted > self._thresholds.memory + _SAME_TIME:
                self.last_trusted = None
            return
        if self.pose is not None and estimate.status is Status.TRACKED:
            self._motion, self._duration = tangent_between(self.pose, estimate.pose), elapsed
        else:
            self._motion, self._duration = np.zeros(26), math.nan
            self._started = estimate.timestamp
        self.pose, self.energy, self._agreement = estimate.pose, estimate.energy, estimate.agreement
        self._confidence, self.branches = estimate.confidence, estimate.branches
        self.time = estimate.timestamp
        if math.isnan(self._doubted_since):
            self.last_trusted, self._trusted = estimate.pose, estimate.timestamp
        self._energies.append(estimate.energy)

    def begins(self, timestamp: float) -> bool:
        """Return whether a track begins at `timestamp` (s).

        A search is due then, and no pose was trusted lately.
        """
        return self.pose is None and self.last_trusted is None and self.is_search_due(timestamp)

    def is_search_due(self, timestamp: float) -> bool:
        """Return whether a hand without a pose is searched for everywhere at `timestamp` (s).

        A hand that stays lost is searched for in the next frame, then after times that double up to `longest_interval`.
        """
        if not self._lost_since < self._previous:
            return True
        return self._searches_until(timestamp) > self._searches_until(self._previous)

    def _searches_until(self, timestamp: float) -> int:
        """Return how many searches are due after that of the second lost frame."""
        limits, elapsed = self._thresholds, max(timestamp - self._lost_since, 0.0) + _SAME_TIME
        return int(math.log2(1 + elapsed / limits.search_interval)) + int(elapsed / limits.longest_interval)

    def is_in_doubt(self, timestamp: float) -> bool:
        """Return whether a start competes with a track of low confidence at `timestamp` (s).

        It does after times that double up to `longest_doubt`. After a pause, a start competes in any case.
        """
        if self.pose is None or not self._reconsiders or self.is_stale(timestamp):
            return False
        if not self._doubted_since <= self._previous <= timestamp:
            return False
        return self._starts_until(timestamp) > self._starts_until(self._previous)

    def _starts_until(self, timestamp: float) -> int:
        """Return how many starts competed with a track of low confidence until then."""
        limits, elapsed = self._thresholds, timestamp - self._doubted_since + _SAME_TIME
        turns = elapsed / limits.doubt_after
        return int(elapsed / limits.longest_doubt) + (1 + int(math.log2(turns)) if turns >= 1 else 0)

    def is_stale(self, timestamp: float) -> bool:
        """Return whether the last pose is too old at `timestamp` (s) to be followed without a rival."""
        return timestamp - self.time > self._thresholds.longest_gap + _SAME_TIME

    def motion_until(self, timestamp: float) -> Array:
        """Return the step (26,) that continues the last motion until `timestamp` (s).

        It is in the tangent space, and zero if the last pose is too old.
        """
        elapsed = timestamp - self.time
        if self.is_stale(timestamp) or elapsed > self._thresholds.memory:
            return np.zeros(26)
        share = elapsed / self._duration if self._duration > 0 else 1.0
        # Rounded time stamps must not change a steady motion.
        return self._motion * share if abs(share - 1) > _ROUNDED else self._motion

    def predicted_pose(self, timestamp: float) -> Array | None:
        """Return the linear prediction (27,) for `timestamp` (s); None for no ROI prior.

        A wrong pose must not guide the segmentation: it would select the pixels that agree with it.
        """
        limits = self._thresholds
        if self.pose is None or self._agreement < limits.guide_agreement or self.is_stale(timestamp):
            return None
        if self.is_in_doubt(timestamp):
            return None
        high = self.energy > limits.energy * self._clamp and self.energy > limits.guide_ratio * self.median_energy
        if high and not self._confidence >= limits.sure_confidence:
            return None
        return retract(self.pose, self.motion_until(timestamp))

    def doubted_pose(self, timestamp: float) -> Array | None:
        """Return the linear prediction (27,) for `timestamp` (s) of a track in doubt; else None."""
        if self.pose is None or not self.is_in_doubt(timestamp):
            return None
        return retract(self.pose, self.motion_until(timestamp))
