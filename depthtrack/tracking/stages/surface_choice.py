"""The choice between surfaces: which one the observed points lie on."""

from dataclasses import dataclass

from depthtrack.errors import InputError
from depthtrack.solver.icp import IcpFitter
from depthtrack.solver.options import SurfaceName
from depthtrack.solver.subspace import FULL
from depthtrack.tracking.candidate import Candidate
from depthtrack.tracking.frame import FrameContext
from depthtrack.tracking.options import SurfaceChoiceOptions
from depthtrack.tracking.stages.surface_fit import SurfaceFit
from depthtrack.types import Array


@dataclass(frozen=True)
class FitChosenSurface:
    """Fit the surface that the observed points lie on, for all fits of the frame.

    The preferred surface is fitted first. If its residual is not small, a brief fit moves each other surface from
    there. One that reduces the residual by the factor `accept` is fitted instead. The choice depends on the frame
    alone, so that a run can be resumed.
    """

    options: SurfaceChoiceOptions
    fit: SurfaceFit
    name: str = "fit"

    def __call__(self, frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]:
        surfaces = (surface for surface in self.options.surfaces if self._fits(frame, surface))
        frame.surface = preferred = next(surfaces)
        fitted = self.fit(frame, candidates)
        pose = fitted[0].pose
        residual = self._fitter(frame, preferred).residual(pose, self.options.scale)
        if residual <= self.options.good_residual:
            return fitted
        chosen, least = preferred, self.options.accept * residual
        for surface in surfaces:
            residual = self._residual_after_fit(frame, surface, pose)
            if residual < least:
                chosen, least = surface, residual
        frame.surface = chosen
        return fitted if chosen == preferred else self.fit(frame, candidates)

    def _residual_after_fit(self, frame: FrameContext, surface: SurfaceName, pose: Array) -> float:
        """Return the residual after a brief fit from `pose` (27,)."""
        fitter = self._fitter(frame, surface)
        moved = fitter.fit(pose, FULL, self.options.iterations, coarse=True, align=False)
        return fitter.residual(moved, self.options.scale)

    def _fitter(self, frame: FrameContext, surface: SurfaceName) -> IcpFitter:
        frame.surface = surface
        return frame.fitter(self.fit.options)

    def _fits(self, frame: FrameContext, surface: SurfaceName) -> bool:
        """Return whether the hand has this surface."""
        try:
            self._fitter(frame, surface)
        except InputError:
            return False
        return True
