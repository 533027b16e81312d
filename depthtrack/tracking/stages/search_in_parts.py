"""A search for the hand that goes on over the frames after a loss, so that no frame is late."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from depthtrack.hand.pose import POSITION
from depthtrack.solver.icp import IcpFitter
from depthtrack.tracking.candidate import Candidate, poses_of
from depthtrack.tracking.frame import FrameContext
from depthtrack.tracking.options import FitRound, GlobalSearchOptions
from depthtrack.tracking.proposals.global_ import distinct_orientations, global_proposals
from depthtrack.tracking.stages.coarse_to_fine import fit_in_synergies
from depthtrack.tracking.stages.searches import FitSearch
from depthtrack.tracking.state import InterruptedSearch
from depthtrack.tracking.timing import FOR_FIT, Deadline


@dataclass(frozen=True)
class SearchInParts:
    """Search for the hand everywhere until the deadline, and go on in the next frame.

    The poses of an interrupted search move with the centre of the hand. Each part returns the best pose so far.
    """

    search: FitSearch
    options: GlobalSearchOptions
    name: str = "search"

    def __call__(self, frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]:
        before = frame.state.search
        part = _moved(before, frame) if before is not None and before.has_begun else self._begun(frame)
        rounds = self.search.options.rounds
        fitter, kept = frame.fitter(self.search.surface), frame.posture_kept(self.search.surface.icp)
        found, deadline = self._scored(frame, part), frame.deadline.sooner(FOR_FIT)
        while part.turn < len(rounds):
            part = self._improved(frame, part, rounds[part.turn], fitter, kept, deadline)
            found = self._scored(frame, part)
            if not len(part.waiting):
                part = self._next_round(part, found)
            if deadline.is_over:
                break
        frame.search = part if part.turn < len(rounds) else None
        return found[:1]

    def _begun(self, frame: FrameContext) -> InterruptedSearch:
        """Return the search before its first round."""
        options, keep = self.options, self.search.options.rounds[0].keep
        poses = global_proposals(frame.observation, frame.tools.synergies, self.search.random(frame), options)
        starts = poses_of(frame.evaluate(poses, options.resolution))
        chosen = starts[distinct_orientations(starts, options.min_angle, keep)]
        return InterruptedSearch(0, chosen, np.empty((0, 27)), frame.observation.centre)

    def _improved(
        self,
        frame: FrameContext,
        part: InterruptedSearch,
        turn: FitRound,
        fitter: IcpFitter,
        kept: float,
        deadline: Deadline,
    ) -> InterruptedSearch:
        """Return the search after fits until the deadline, one at least."""
        fit = partial(fit_in_synergies, synergies=frame.tools.synergies, options=turn, kept=kept)
        first = iter([False])
        fitted = frame.tools.fits.fit_each(fitter, part.waiting, fit, lambda: next(first, True) and deadline.is_over)
        improved = np.concatenate([part.improved, np.stack(fitted)])
        return part._replace(waiting=part.waiting[len(fitted) :], improved=improved)

    def _next_round(self, part: InterruptedSearch, found: list[Candidate]) -> InterruptedSearch:
        """Return the search before its next round, of the best candidates."""
        turn, rounds = part.turn + 1, self.search.options.rounds
        keep = rounds[turn].keep if turn < len(rounds) else 1
        return InterruptedSearch(turn, poses_of(found[:keep]), np.empty((0, 27)), part.centre)

    def _scored(self, frame: FrameContext, part: InterruptedSearch) -> list[Candidate]:
        """Return the improved candidates, best first; the waiting ones if none is improved."""
        return frame.evaluate(part.improved if len(part.improved) else part.waiting)


def _moved(part: InterruptedSearch, frame: FrameContext) -> InterruptedSearch:
    """Return an interrupted search whose poses moved with the hand."""
    centre, step = frame.observation.centre, np.zeros(27)
    step[POSITION] = centre - part.centre
    return part._replace(waiting=part.waiting + step, improved=part.improved + step, centre=centre)
