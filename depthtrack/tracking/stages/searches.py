"""Searches that improve many start poses: by swarms, or by surface fits from coarse to fine."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from depthtrack.errors import InputError
from depthtrack.rendering.scorer import Scorer
from depthtrack.solver.icp import IcpFitter
from depthtrack.solver.options import SurfaceFitOptions
from depthtrack.tracking.candidate import Candidate, by_energy, evaluate, poses_of
from depthtrack.tracking.frame import FrameContext
from depthtrack.tracking.options import FitSearchOptions, GlobalSearchOptions, SwarmSearchOptions
from depthtrack.tracking.proposals.global_ import distinct_orientations, global_proposals
from depthtrack.tracking.stages.coarse_to_fine import run_rounds
from depthtrack.tracking.stages.swarm import swarm_around


class Search(Protocol):
    """Improves start poses on one frame."""

    def improve(self, frame: FrameContext, starts: list[Candidate], min_angle: float) -> list[Candidate]:
        """Return candidates, best first, reached from `starts`, best first.

        min_angle: least angle (rad) between the orientations of the poses that continue; 0 for any.
        """
        ...

    def fitter(self, frame: FrameContext) -> IcpFitter | None:
        """Return the surface fitter of the search, or None if it fits no surface."""
        ...

    def random(self, frame: FrameContext) -> np.random.Generator:
        """Return the random numbers of the search."""
        ...


@dataclass(frozen=True)
class SwarmSearch:
    """Search by rounds of fewer and finer swarms, with surface fits between the rounds."""

    options: SwarmSearchOptions

    def improve(self, frame: FrameContext, starts: list[Candidate], min_angle: float) -> list[Candidate]:
        return swarm_search(frame.tools.scorer, starts, frame.random, self.options, min_angle, self.fitter(frame))

    def fitter(self, frame: FrameContext) -> IcpFitter | None:
        if not self.options.refine:
            return None
        try:
            return frame.fitter(self.options.fit)
        except InputError:
            return None  # no skin fits these sizes

    def random(self, frame: FrameContext) -> np.random.Generator:
        return frame.random


def swarm_search(
    scorer: Scorer,
    starts: list[Candidate],
    generator: np.random.Generator,
    options: SwarmSearchOptions,
    min_angle: float,
    fitter: IcpFitter | None = None,
) -> list[Candidate]:
    """Return candidates, best first, after all rounds from `starts`, best first.

    Starts differ in orientation by `min_angle` (rad), so that the mirrored pose and other likely errors take part.
    """
    first = options.rounds[0].starts
    found = [starts[i] for i in distinct_orientations(poses_of(starts), min_angle, first)] if min_angle > 0 else starts
    for turn in options.rounds:
        found = by_energy(
            swarm_around(scorer, start.pose, turn.spread, turn.swarm, generator) for start in found[: turn.starts]
        )
        if fitter is not None:
            fitted = evaluate(scorer, np.stack([fitter.fit(candidate.pose) for candidate in found[: options.refined]]))
            found = by_energy([*found, *fitted])
    return found


@dataclass(frozen=True)
class FitSearch:
    """Search by rounds of surface fits of fewer poses.

    goes_on: whether a fitted pose is worth another round; None for all.
    """

    options: FitSearchOptions
    surface: SurfaceFitOptions
    goes_on: Callable[[Candidate], bool] | None = None

    def improve(self, frame: FrameContext, starts: list[Candidate], min_angle: float) -> list[Candidate]:
        keep = self.options.rounds[0].keep
        if min_angle > 0:
            starts = [starts[i] for i in distinct_orientations(poses_of(starts), min_angle, keep)]
        tools, kept = frame.tools, frame.posture_kept(self.surface.icp)
        fitter, rounds = frame.fitter(self.surface), self.options.rounds
        return run_rounds(
            fitter, tools.fits, tools.scorer, starts, tools.synergies, rounds, kept, frame.deadline, self.goes_on
        )

    def fitter(self, frame: FrameContext) -> IcpFitter | None:
        return frame.fitter(self.surface)

    def random(self, frame: FrameContext) -> np.random.Generator:
        return frame.new_random()


def search_globally(frame: FrameContext, search: Search, options: GlobalSearchOptions) -> Candidate:
    """Return the best candidate of repeated global searches (Oikonomidis et al. 2011, Sec. 3).

    The search ends if a repetition gains little: a hand of other sizes than the model's has no good pose.
    """
    best: Candidate | None = None
    generator, observation = search.random(frame), frame.observation
    good = options.accepted_energy(frame.clamp, frame.state.median_energy)
    for _ in range(options.attempts):
        poses = global_proposals(observation, frame.tools.synergies, generator, options)
        found = search.improve(frame, frame.evaluate(poses, options.resolution), options.min_angle)[0]
        before = np.inf if best is None else best.energy
        best = found if best is None or found.energy < best.energy else best
        if best.energy <= good or best.energy > (1 - options.min_gain) * before:
            break
    assert best is not None
    return best
