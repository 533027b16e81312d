"""Proposals of a small swarm, refined by surface fits and verified by rendering."""

from dataclasses import dataclass

import numpy as np

from depthtrack.hand.pose import retract
from depthtrack.solver.swarm_space import TangentSpace
from depthtrack.tracking.candidate import Candidate, by_energy
from depthtrack.tracking.frame import FrameContext
from depthtrack.tracking.options import SwarmProposalOptions
from depthtrack.tracking.stages.surface_fit import SurfaceFit
from depthtrack.tracking.stages.swarm import run_swarm
from depthtrack.tracking.timing import FOR_FIT


@dataclass(frozen=True)
class SwarmProposals:
    """Search with a small swarm around the best candidate, and fit its best particles.

    A fitted proposal is accepted if its energy is lower than `accept` times that of the best candidate.
    """

    options: SwarmProposalOptions
    fit: SurfaceFit
    name: str = "swarm"

    def __call__(self, frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]:
        best, options = candidates[0], self.options
        if best.energy <= options.skip_ratio * frame.state.energy or frame.deadline.is_over:
            return candidates
        last = frame.state.pose
        assert last is not None
        space = TangentSpace(best.pose)
        centres = np.tile(best.pose, (options.swarm.particles, 1))
        centres[1::3] = retract(last, frame.motion)
        centres[2::3] = last
        steps = frame.random.standard_normal((len(centres), 26)) * np.repeat(options.spread, [3, 3, 20])
        steps[:3] = 0  # the centres themselves take part
        particles = space.coordinates(retract(centres, steps))
        deadline = frame.deadline.sooner(FOR_FIT)
        proposals = run_swarm(frame.tools.scorer, space, particles, frame.random, options.swarm, deadline)
        fitted = self.fit.fitted(frame, proposals[: options.keep])
        return by_energy([best, *fitted]) if fitted[0].energy < options.accept * best.energy else candidates
