"""Surface fits: ICP of candidates to the point cloud (Schroeder et al. 2014, Sec. IV)."""

from dataclasses import dataclass

import numpy as np

from depthtrack.hand.pose import ANGLES
from depthtrack.solver.icp import IcpFitter
from depthtrack.solver.options import SurfaceFitOptions
from depthtrack.solver.prior import Prior
from depthtrack.solver.subspace import FULL, PostureSubspace
from depthtrack.tracking.candidate import Candidate, by_energy
from depthtrack.tracking.frame import FrameContext
from depthtrack.tracking.posture_prior import prior_near
from depthtrack.types import Array


@dataclass(frozen=True)
class SurfaceFit:
    """Fit the hand's surface to the point cloud from the best candidate.

    prior: pull on the angles.
    hold_last: without `prior`, hold the angles near those of the last frame, or of the candidate if there is none.
    subspace: posture parameters that are solved for.
    align: first move the hand as a rigid body.
    effort: multiple of the usual ICP iterations.
    """

    options: SurfaceFitOptions
    prior: Prior | None = None
    hold_last: bool = True
    subspace: PostureSubspace = FULL
    align: bool = True
    effort: int = 1
    name: str = "fit"

    def __call__(self, frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]:
        return self.fitted(frame, candidates[:1])

    def fitted(self, frame: FrameContext, candidates: list[Candidate], effort: int | None = None) -> list[Candidate]:
        """Return all candidates fitted, best first."""
        fitter, prior = frame.fitter(self.options), self.prior
        icp, last = self.options.icp, frame.last_pose
        if prior is None and self.hold_last and (last is not None or icp.posture_weight > 0):
            before = candidates[0].pose if last is None else last
            prior = prior_near(before[ANGLES], frame.posture_kept(icp), icp)
        iterations = (effort or self.effort) * icp.icp_iterations

        def fit(own: IcpFitter, pose: Array) -> Array:
            return own.fit(pose, self.subspace, iterations, prior, align=self.align)

        poses = [candidate.pose for candidate in candidates]
        return frame.evaluate(np.stack(frame.tools.fits.fit_each(fitter, poses, fit)))


@dataclass(frozen=True)
class RetryPredictions:
    """Fit the other predictions if the first fit has a high energy, then fit the best longer.

    ratio, margin: an energy is high above `ratio` times that of the last frame plus `margin` (clamp).
    """

    fit: SurfaceFit
    ratio: float
    margin: float
    name: str = "retry"

    def __call__(self, frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]:
        satisfied = self.ratio * frame.state.energy + self.margin * frame.clamp
        if candidates[0].energy <= satisfied or frame.deadline.is_over:
            return candidates
        if others := frame.predictions[1:]:
            candidates = by_energy([*candidates, *self.fit.fitted(frame, others)])
        if candidates[0].energy <= satisfied or frame.deadline.is_over:
            return candidates
        return by_energy([*candidates, *self.fit.fitted(frame, candidates[:1], effort=2)])
