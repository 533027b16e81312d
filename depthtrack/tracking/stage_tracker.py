"""Tracker made of stages: lists of stages over candidates, and the state between frames."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from numpy.typing import ArrayLike

from depthtrack.recording.branches import Branch
from depthtrack.recording.status import Status
from depthtrack.segmentation.observation import Observation, Resegmentation
from depthtrack.tracking.candidate import Candidate, evaluate, seen_part
from depthtrack.tracking.confidence import Evidence, evidence_of, fitted_model
from depthtrack.tracking.frame import FrameContext, Toolkit
from depthtrack.tracking.options import TrackingThresholds
from depthtrack.tracking.random import checked_pose
from depthtrack.tracking.spread import bones_in_view
from depthtrack.tracking.stages.stage import Stage
from depthtrack.tracking.start_choice import Start, StartChoice, start_cost
from depthtrack.tracking.state import InterruptedSearch, TrackState
from depthtrack.tracking.timing import Deadline, StageClock
from depthtrack.tracking.tracker import ABSENT, Estimate
from depthtrack.types import Array


@dataclass(frozen=True)
class Stages:
    """Lists of stages of a tracker.

    follow: stages from the pose of the last frame.
    start: stages without a pose.
    refine: stages from a pose that the user gave.
    """

    follow: Sequence[Stage]
    start: Sequence[Stage]
    refine: Sequence[Stage]


class _Proposal(NamedTuple):
    """Best candidate of a frame, and what its estimate states.

    place: cost of the place of the hand, see `Observation.cost`, metres.
    may_jump: whether it may be far from the last pose.
    The other fields are those of `Estimate`, and the arguments of `TrackState.commit`.
    """

    candidate: Candidate
    status: Status
    branches: tuple[Branch, ...]
    seen: Candidate
    evidence: Evidence
    confidence: float
    visibility: tuple[float, ...]
    spread: tuple[float, ...]
    place: float
    seen_energy: float
    may_jump: bool = False


class StageTracker:
    """Tracker with lists of stages: see `tracker.Tracker`.

    evidence: figures that the confidence of the last estimate depends on.
    """

    def __init__(
        self,
        name: str,
        stages: Stages,
        tools: Toolkit,
        thresholds: TrackingThresholds,
        seed: int,
        deadline: float | None = None,
    ) -> None:
        """Make a tracker of stages.

        deadline: milliseconds after a frame arrives at which its searches end; None for none.
        """
        self.name, self._stages, self._tools, self._seed, self._deadline = name, stages, tools, seed, deadline
        self._thresholds = thresholds
        self._state = TrackState(thresholds, tools.scoring.objective.clamp, reconsiders=deadline is None)
        listed = (stage.name for stage in (*stages.follow, *stages.start, *stages.refine))
        self.stages: tuple[str, ...] = tuple(dict.fromkeys(("target", *listed, "confidence")))
        self._confidence = fitted_model()
        self.evidence: Evidence | None = None

    def start(self, observation: Observation, pose: ArrayLike | None = None) -> Estimate:
        """Start on this frame: refine a pose (27,), or search if there is none."""
        self._state.forget_last()
        if pose is None:
            return self._estimate(observation, {Status.STARTED: self._stages.start})
        return self._estimate(observation, {Status.STARTED: self._stages.refine}, checked_pose(pose))

    def track(self, observation: Observation) -> Estimate:
        """Follow the hand into the next frame; search if the track is lost or there is none.

        After a pause, a search competes with the last pose.
        """
        if self._state.pose is None:
            return self._estimate(observation, {Status.STARTED: self._stages.start})
        if observation.resegmentation is not None and self._state.is_in_doubt(observation.timestamp):
            return self._reconsider(observation, observation.resegmentation)
        rival = {Status.STARTED: self._stages.start} if self._state.is_stale(observation.timestamp) else {}
        return self._estimate(observation, {Status.TRACKED: self._stages.follow} | rival)

    def restore(self, estimates: Sequence[Estimate]) -> None:
        """Update the state with estimates as if they had been made now."""
        self._state.restore(estimates)

    def predicted_pose(self, timestamp: float) -> Array | None:
        """Return the pose (27,) predicted for `timestamp` (s); None for no ROI prior."""
        return self._state.predicted_pose(timestamp)

    def doubted_pose(self, timestamp: float) -> Array | None:
        """Return the pose (27,) predicted for `timestamp` (s) by a track in doubt; else None."""
        return self._state.doubted_pose(timestamp)

    def start_at(self, pose: Array, place: float, resegmentation: Resegmentation) -> Start:
        """Return a start in the region of interest of its pose (27,).

        place: cost of the place of the hand, metres.
        """
        around, tools = resegmentation.around(pose), self._tools
        if around is None:
            return Start(math.inf, 0.0, place)
        tools.set_target(around)
        found = self._assessed(evaluate(tools.scorer, pose[None])[0])
        return Start(found.seen_energy / tools.scoring.objective.clamp, found.confidence, place)

    def close(self) -> None:
        """Free the renderers."""
        self._tools.close()

    def _estimate(
        self, observation: Observation, lists: dict[Status, Sequence[Stage]], pose: Array | None = None
    ) -> Estimate:
        """Return the best estimate of some lists of stages, by the status that each implies.

        It is absent if the stages find no candidate. A start is also moved and bent; a doubtful one tries other places
        of the hand, and after a pause it searches again. After a loss, a start without the last pose competes with a
        doubtful pose near it.

        pose: (27,) given by the user.
        """
        clock = StageClock(self.stages)
        begins = pose is None and self._state.begins(observation.timestamp)
        lost = self._state.pose is None and self._state.is_search_due(observation.timestamp)
        after_pause = Status.TRACKED in lists and Status.STARTED in lists
        best = self._propose(observation, lists, clock, pose)
        if best is None:
            return self._absent(observation, clock)
        again = observation.resegmentation if self._deadline is None and pose is None else None
        if begins and again is not None:
            best = self._best_start(best, again, lists, clock)
        elif lost and again is not None and best.confidence < self._thresholds.doubt_confidence:
            best = self._or_anew(best, observation, again, clock)
        if after_pause and self._deadline is None and best.confidence < self._thresholds.start_confidence:
            best = self._start_again(best, observation, clock)
        return self._committed(best, observation, clock)

    def _reconsider(self, observation: Observation, resegmentation: Resegmentation) -> Estimate:
        """Return the estimate of a track in doubt, with which a start competes.

        observation: made without a prior.
        """
        clock, doubted = StageClock(self.stages), self._state.doubted_pose(observation.timestamp)
        around = None if doubted is None else resegmentation.around(doubted)
        follow = self._propose(around or observation, {Status.TRACKED: self._stages.follow}, clock)
        if follow is None:
            return self._absent(observation, clock)
        return self._committed(self._or_anew(follow, observation, resegmentation, clock), observation, clock)

    def _or_anew(
        self, best: _Proposal, observation: Observation, resegmentation: Resegmentation, clock: StageClock
    ) -> _Proposal:
        """Return a doubtful estimate, or a start without the last pose that costs clearly less.

        Confidence does not count: it prefers common postures, to which the fits of a start are drawn.
        """
        starts = {Status.STARTED: self._stages.start}
        found = self._propose(observation, starts, clock, anew=True)
        if found is None:
            return best
        found = self._best_start(found, resegmentation, starts, clock, anew=True)
        before, after = (
            start_cost(start._replace(confidence=0.0), self._thresholds)
            for start in (self.start_at(each.candidate.pose, each.place, resegmentation) for each in (best, found))
        )
        clock.lap("target")
        return found._replace(may_jump=True) if after < before - self._thresholds.doubt_margin else best

    def _absent(self, observation: Observation, clock: StageClock) -> Estimate:
        """Update the state with the estimate of a frame without a candidate, and return it."""
        estimate = replace(ABSENT, stage_ms=clock.milliseconds, timestamp=observation.timestamp)
        self._state.update(estimate)
        return estimate

    def _committed(self, best: _Proposal, observation: Observation, clock: StageClock) -> Estimate:
        """Update the state with a proposal; return its estimate."""
        self.evidence = best.evidence
        return self._state.commit(
            *best.candidate,
            best.status,
            clock.milliseconds,
            observation.timestamp,
            best.confidence,
            best.visibility,
            best.spread,
            best.branches,
            best.seen,
            best.seen_energy,
            best.may_jump,
        )

    def _start_again(self, best: _Proposal, observation: Observation, clock: StageClock) -> _Proposal:
        """Return the better one of a doubtful estimate after a pause and of another start."""
        again = self._propose(observation, {Status.STARTED: self._stages.start}, clock, repeat=1)
        return best if again is None or again.candidate.energy >= best.candidate.energy else again

    def _best_start(
        self,
        first: _Proposal,
        resegmentation: Resegmentation,
        lists: dict[Status, Sequence[Stage]],
        clock: StageClock,
        anew: bool = False,
    ) -> _Proposal:
        """Return the best of a start, of those moved or bent, and of those at other places.

        anew: see `_propose`.
        """
        refine = {Status.STARTED: self._stages.refine}
        choice = StartChoice[_Proposal](
            self._thresholds,
            search=lambda other: self._propose(other, lists, clock, anew=anew),
            refine=lambda around, pose: self._propose(around, refine, clock, pose, anew=anew),
            judge=self.start_at,
        )
        best = choice.best(first, resegmentation)
        clock.lap("target")
        return best

    def _propose(
        self,
        observation: Observation,
        lists: dict[Status, Sequence[Stage]],
        clock: StageClock,
        pose: Array | None = None,
        repeat: int = 0,
        anew: bool = False,
    ) -> _Proposal | None:
        """Return the best candidate of some lists of stages, or None without any.

        repeat: number of the repetition, which has other random numbers.
        anew: whether searches leave the last pose out.
        """
        deadline = Deadline.after(self._deadline, observation.arrived)
        self._tools.set_target(observation)
        clock.lap("target")
        found: list[tuple[Candidate, Status, tuple[Branch, ...]]] = []
        interrupted: InterruptedSearch | None = None
        for status, stages in lists.items():
            seed = self._seed + repeat
            frame = FrameContext(observation, self._tools, self._state, seed, pose, deadline=deadline, anew=anew)
            candidates = list[Candidate]()
            for stage in stages:
                candidates = stage(frame, candidates)
                clock.lap(stage.name)
            interrupted = frame.search or interrupted
            if candidates:
                found.append((candidates[0], Status.STARTED if frame.restarted else status, frame.branches))
        self._state.search = interrupted
        if not found:
            return None
        best, status, branches = min(found, key=lambda pair: pair[0].energy)
        assessed = self._assessed(best)
        clock.lap("confidence")
        return assessed._replace(status=status, branches=branches, place=observation.cost)

    def _assessed(self, best: Candidate) -> _Proposal:
        """Return a candidate with its evidence, as a start without branches at no cost of its place."""
        tools, target, rendered = self._tools, self._tools.scorer.target, self._tools.scorer.render(best.pose)
        seen = seen_part(best, rendered, target, tools.scoring.objective)
        bones = bones_in_view(tools.model, best.pose, rendered, target)
        evidence = evidence_of(best.pose, rendered, target, bones, seen.energy / tools.scoring.objective.clamp)
        figures = tuple(bones.finger_visibility.tolist()), tuple(bones.spread.tolist())
        inside = tools.share_in_image(best.pose)
        seen_energy = inside * seen.energy + (1 - inside) * tools.scoring.objective.clamp
        return _Proposal(
            best, Status.STARTED, (), seen, evidence, self._confidence(evidence), *figures, 0.0, seen_energy
        )
