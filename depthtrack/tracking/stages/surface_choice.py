"""The choice between surfaces: which one the observed points lie on."""

from dataclasses import dataclass

import numpy as np

from depthtrack.errors import InputError
from depthtrack.solver.options import SurfaceFitOptions, SurfaceName
from depthtrack.solver.subspace import FULL
from depthtrack.tracking.candidate import Candidate
from depthtrack.tracking.frame import FrameContext
from depthtrack.tracking.options import SurfaceChoiceOptions


@dataclass(frozen=True)
class ChooseSurface:
    """Choose the surface with the lowest residual of a brief fit, for all fits of the frame.

    The first surface is preferred. The others are tried only if its residual is not small, and must reduce it by the
    factor `accept`. The choice depends on the frame alone, so that a run can be resumed.
    """

    options: SurfaceChoiceOptions
    fit: SurfaceFitOptions
    name: str = "surface"

    def __call__(self, frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]:
        first, *others = self.options.surfaces
        residual = self._residual(frame, candidates[0], first)
        residuals = [self.options.accept * residual]
        if residual > self.options.good_residual:
            residuals += [self._residual(frame, candidates[0], surface) for surface in others]
        frame.surface = self.options.surfaces[int(np.argmin(residuals))]
        return candidates

    def _residual(self, frame: FrameContext, candidate: Candidate, surface: SurfaceName) -> float:
        """Return the residual of a brief fit; infinity if the hand has no such surface."""
        frame.surface = surface
        try:
            fitter = frame.fitter(self.fit)
        except InputError:
            return np.inf
        pose = fitter.fit(candidate.pose, FULL, self.options.iterations, coarse=True, align=False)
        return fitter.residual(pose, self.options.scale)
