"""Recovery: global and local re-initialisation, and other postures of single fingers."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from depthtrack.hand.pose import ANGLES, POSITION
from depthtrack.rendering.scorer import Scorer
from depthtrack.solver.options import SurfaceFitOptions
from depthtrack.solver.prior import Prior
from depthtrack.tracking.candidate import Candidate
from depthtrack.tracking.frame import FrameContext
from depthtrack.tracking.options import FingerOptions, GlobalSearchOptions, RecoveryOptions
from depthtrack.tracking.proposals.fingers import finger_shift_proposals, search_one_finger
from depthtrack.tracking.proposals.local import local_proposals
from depthtrack.tracking.stages.searches import Search, search_globally
from depthtrack.tracking.stages.stage import Stage


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

    Proposals are other postures of single fingers, and all fingers shifted by one place.

    refit: surface fit after a finger changed; None keeps the rendered candidate.
    """

    search: Search
    recovery: RecoveryOptions
    options: FingerOptions
    refit: SurfaceFitOptions | None = None
    name: str = "fingers"

    def __call__(self, frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]:
        best, good = candidates[0], self.recovery.good_energy * frame.clamp
        if frame.restarted or best.energy <= good or self.recovery.accept_finger == 0:
            return candidates
        fit = self.search.fit(frame)
        if fit is not None:
            shifted = np.stack([fit(pose) for pose in finger_shift_proposals(frame.tools.model, best.pose)])
            best = self._accepted(best, frame.evaluate(shifted)[0])
        scorer, generator = frame.tools.scorer_at(self.options.resolution, frame.observation), self.search.random(frame)
        for finger in range(5):
            if self.options.stop_early and best.energy <= good:
                break
            found = search_one_finger(scorer, best.pose, finger, generator, self.options)
            best = self._accepted(best, found) if self.refit is None else self._refitted(frame, scorer, best, found)
        return [best]

    def _refitted(self, frame: FrameContext, scorer: Scorer, best: Candidate, found: Candidate) -> Candidate:
        """Return the surface fit of `found` if its energy is low enough, else `best`.

        The energy of `found` at low resolution is compared first.
        """
        assert self.refit is not None
        if found.energy >= self.recovery.accept_finger * scorer.score(best.pose[None])[0]:
            return best
        # The prior holds the angles that no correspondence constrains where the search found them.
        prior = Prior.towards(found.pose[ANGLES], self.refit.icp.temporal_weight)
        fitted = frame.fitter(self.refit).fit(found.pose, prior=prior)
        return self._accepted(best, frame.evaluate(fitted[None])[0])

    def _accepted(self, best: Candidate, other: Candidate) -> Candidate:
        return other if other.energy < self.recovery.accept_finger * best.energy else best


@dataclass(frozen=True)
class RecoverLocally:
    """Search near the pose, regularly in frames that fit poorly and at once in doubtful ones.

    If the pose is doubtful, the stages `elsewhere` run too; a pose from there restarts the track.
    """

    search: Search
    options: RecoveryOptions
    elsewhere: Sequence[Stage] = ()
    name: str = "recover"

    def __call__(self, frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]:
        best, options = candidates[0], self.options
        doubtful = frame.state.is_beyond(best.energy, best.confidence, options.doubt_energy, options.doubt_confidence)
        due = options.every > 0 and frame.observation.frame_index % options.every == 0
        if best.energy <= options.good_energy * frame.clamp or not (due or doubtful):
            return candidates
        proposals = local_proposals(best.pose, self.search.random(frame), options)
        near = self.search.improve(frame, proposals, options.min_angle)[0]
        if near.energy < (1 if doubtful else options.accept_local) * best.energy:
            best = near
        if self.elsewhere and doubtful:
            found: list[Candidate] = []
            for stage in self.elsewhere:
                found = stage(frame, found)
            if found[0].energy < options.accept_global * best.energy:
                frame.restarted = True
                return found
        return [best]


@dataclass(frozen=True)
class ReinitialiseNearLast:
    """Search near the last trusted pose after a loss.

    A hand hardly turns over in half a second.
    """

    search: Search
    options: RecoveryOptions
    fingers: RefineFingers
    name: str = "reinitialise"

    def __call__(self, frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]:
        last = frame.state.last_trusted
        if last is None:
            return candidates
        pose = last.copy()
        pose[POSITION] = frame.observation.centre
        proposals = local_proposals(pose, self.search.random(frame), self.options)
        near = self.fingers(frame, self.search.improve(frame, proposals, self.options.min_angle)[:1])
        return candidates if candidates[0].energy < self.options.accept_global * near[0].energy else near
