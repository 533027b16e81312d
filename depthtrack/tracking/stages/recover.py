"""Recovery: global and local re-initialisation, and other postures of single fingers."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from depthtrack.hand.pose import ANGLES, POSITION
from depthtrack.rendering.scorer import Scorer
from depthtrack.solver.icp import IcpFitter
from depthtrack.solver.options import SurfaceFitOptions
from depthtrack.tracking.candidate import Candidate
from depthtrack.tracking.frame import FrameContext
from depthtrack.tracking.options import FingerOptions, GlobalSearchOptions, RecoveryOptions
from depthtrack.tracking.posture_prior import prior_near
from depthtrack.tracking.proposals.fingers import finger_shift_proposals, search_one_finger
from depthtrack.tracking.proposals.local import local_proposals
from depthtrack.tracking.stages.searches import Search, search_globally
from depthtrack.tracking.stages.stage import Stage
from depthtrack.tracking.tracker import Estimate

_SHIFTS = 5
"""Turn of the shifted fingers, after those of the five fingers."""


@dataclass(frozen=True)
class SearchGlobally:
    """Find a pose from the observation alone."""

    search: Search
    options: GlobalSearchOptions
    name: str = "search"

    def __call__(self, frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]:
        return [search_globally(frame, self.search, self.options)]


@dataclass(frozen=True)
class RefineFingers:
    """Try other postures of fingers in frames that fit poorly.

    Proposals are other postures of single fingers, and all fingers shifted by one place. They take turns over
    `options.turns` frames, or over `options.usual_turns` in frames whose energy is not elevated.

    refit: surface fit after a finger changed; None keeps the rendered candidate.
    """

    search: Search
    recovery: RecoveryOptions
    options: FingerOptions
    refit: SurfaceFitOptions | None = None
    name: str = "fingers"

    def __call__(self, frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]:
        best, good = candidates[0], self.recovery.good_energy * frame.clamp
        if frame.restarted or best.energy <= good or self.recovery.accept_finger == 0 or frame.deadline.is_over:
            return candidates
        due = self._due_turns(frame, best)
        fitter = self.search.fitter(frame)
        if fitter is not None and _SHIFTS in due:
            shifted = self._shifted(frame, best, fitter)
            best = shifted if shifted.energy < self.recovery.accept_shift * best.energy else best
        scorer, generator = frame.tools.scorer_at(self.options.resolution, frame.observation), self.search.random(frame)
        for finger in sorted(due - {_SHIFTS}):
            if frame.deadline.is_over or (self.options.stop_early and best.energy <= good):
                break
            found = search_one_finger(scorer, best.pose, finger, generator, self.options)
            if self.refit is not None:
                found = self._refitted(frame, self.refit, scorer, best, found)
            best = self._accepted(frame, best, found, finger)
        return [best]

    def _shifted(self, frame: FrameContext, best: Candidate, fitter: IcpFitter) -> Candidate:
        """Return the better fit of the fingers shifted by one place, in both directions."""
        fits, brief = frame.tools.fits, self.options.shift_iterations
        proposals = finger_shift_proposals(frame.tools.model, best.pose)
        if brief > 0:
            briefly = partial(IcpFitter.fit, iterations=brief, coarse=True)
            coarse = frame.evaluate(np.stack(fits.fit_each(fitter, proposals, briefly)))
            if coarse[0].energy >= self.options.shift_margin * best.energy:
                return coarse[0]
            proposals = coarse[0].pose[None]
        return frame.evaluate(np.stack(fits.fit_each(fitter, proposals, IcpFitter.fit)))[0]

    def _due_turns(self, frame: FrameContext, best: Candidate) -> set[int]:
        """Return the turns of this frame: fingers 0 to 4, and `_SHIFTS`."""
        elevated = frame.state.is_elevated(best.energy, self.recovery.elevated_ratio)
        turns = self.options.turns if elevated else self.options.usual_turns
        return {turn for turn in range(_SHIFTS + 1) if turn % turns == frame.observation.frame_index % turns}

    def _refitted(
        self, frame: FrameContext, refit: SurfaceFitOptions, scorer: Scorer, best: Candidate, found: Candidate
    ) -> Candidate:
        """Return the surface fit of `found` if its energy is low at low resolution, else `best`.

        A fit may pull the finger back to other points. Then its energy is clearly higher, and `found` stays in a start.
        A track has the next frames to find the finger, and would keep the inaccuracy of a searched posture.
        """
        if found.energy >= self.recovery.accept_finger * scorer.score(best.pose[None])[0]:
            return best
        # The prior holds the angles that no correspondence constrains near where the search found them.
        prior = prior_near(found.pose[ANGLES], frame.posture_kept(refit.icp), refit.icp)
        fitted = frame.fitter(refit).fit(found.pose, prior=prior)
        fit, kept = (frame.evaluate(pose[None])[0] for pose in (fitted, found.pose))
        starts = frame.last_pose is None or frame.state.is_stale(frame.observation.timestamp)
        return kept if starts and kept.energy < self.recovery.accept_finger * fit.energy else fit

    def _accepted(self, frame: FrameContext, best: Candidate, other: Candidate, finger: int) -> Candidate:
        """Return `other` if its energy is low enough, else `best`.

        A hidden finger costs nearly the same in any posture: a little less is no evidence of another one.
        """
        if other.energy >= self.recovery.accept_finger * best.energy:
            return best
        if other.energy < self.recovery.accept_hidden * best.energy:
            return other
        return other if frame.finger_visibility(other.pose)[finger] >= self.options.seen_share else best


@dataclass(frozen=True)
class RecoverLocally:
    """Search near the pose: at once in doubtful frames, in every n-th frame if it fits poorly.

    If the pose is still doubtful then, the stages `elsewhere` run; a pose from there restarts the track. They also run
    while a search goes on that the deadline interrupted.

    routine: smaller search of frames that are not doubtful; None for `search`.
    """

    search: Search
    options: RecoveryOptions
    elsewhere: Sequence[Stage] = ()
    routine: Search | None = None
    name: str = "recover"

    def __call__(self, frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]:
        best, options = candidates[0], self.options
        if best.energy <= options.good_energy * frame.clamp or frame.deadline.is_over:
            return candidates
        doubtful = self._is_doubtful(frame, best)
        due = options.every > 0 and frame.observation.frame_index % options.every == 0
        due = due and frame.state.is_elevated(best.energy, options.elevated_ratio)
        goes_on = frame.state.search is not None
        if not (due or doubtful or goes_on):
            return candidates
        search, spread = self.search, options
        if self.routine is not None and not doubtful:
            search, spread = self.routine, options.routine
        if not goes_on:
            proposals = local_proposals(best.pose, search.random(frame), spread)
            near = search.improve(frame, frame.evaluate(proposals, options.resolution), options.min_angle)[0]
            if near.energy < (1 if doubtful else options.accept_local) * best.energy:
                best = near
        if self.elsewhere and (goes_on or (doubtful and self._is_doubtful(frame, best))):
            if not goes_on and frame.puts_search_off():
                return [best]
            found = run_stages(self.elsewhere, frame)
            if found[0].energy < options.accept_global * best.energy:
                frame.restarted = True
                return found
        return [best]

    def _is_doubtful(self, frame: FrameContext, best: Candidate) -> bool:
        options = self.options
        return frame.state.is_beyond(best.energy, best.agreement, options.doubt_energy, options.doubt_agreement)


@dataclass(frozen=True)
class Reinitialise:
    """Search for a lost hand: near its last pose, then elsewhere if no pose there fits.

    A hand hardly turns over in half a second. A hand that stays lost is searched for elsewhere at growing intervals.

    near: brief search near the last trusted pose, or near the best pose of the lost frame before.
    fit: stages after it.
    elsewhere: stages of a brief search from the observation alone, soon after a loss.
    start: the same at other times.
    """

    near: Search
    options: RecoveryOptions
    good: GlobalSearchOptions
    fit: Sequence[Stage]
    elsewhere: Sequence[Stage]
    start: Sequence[Stage]
    name: str = "reinitialise"

    def __call__(self, frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]:
        state = frame.state
        near = self._near_last(frame) if state.search is None and not frame.anew else []
        is_due = state.search is not None or state.is_search_due(frame.observation.timestamp)
        if near and state.lost is not None and (not is_due or self._is_good(frame, near[0], state.lost)):
            return near
        if near and frame.puts_search_off():
            return near
        brief = state.lost is not None and state.last_trusted is not None and not frame.anew
        found = run_stages(self.elsewhere if brief else self.start, frame)
        return near if near and found[0].energy >= self.options.accept_global * near[0].energy else found

    def _is_good(self, frame: FrameContext, near: Candidate, lost: Estimate) -> bool:
        """Return whether a pose fits, and fits better than the lost one.

        A pose that is lost for another reason than its energy has wrong poses near it.
        """
        good = self.good.accepted_energy(frame.clamp, frame.state.median_energy)
        return near.energy <= min(good, self.options.accept_local * lost.energy)

    def _near_last(self, frame: FrameContext) -> list[Candidate]:
        """Return the best pose near the last one; none without a last pose."""
        last, lost = frame.state.last_trusted, frame.state.lost
        if last is None and lost is not None:
            last = lost.pose
        if last is None:
            return []
        pose = last.copy()
        pose[POSITION] = frame.observation.centre
        proposals = local_proposals(pose, self.near.random(frame), self.options)
        starts = frame.evaluate(proposals, self.options.resolution)
        return run_stages(self.fit, frame, self.near.improve(frame, starts, self.options.min_angle)[:1])


def run_stages(stages: Sequence[Stage], frame: FrameContext, candidates: Sequence[Candidate] = ()) -> list[Candidate]:
    """Return the candidates after all stages.

    If the deadline interrupts a search, the stages after it do not run.
    """
    found = list(candidates)
    for stage in stages:
        found = stage(frame, found)
        if frame.search is not None and frame.deadline.is_over:
            break
    return found
