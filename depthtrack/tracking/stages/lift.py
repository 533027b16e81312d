"""Lifting of keypoints from elsewhere to the pose of each frame."""

from dataclasses import dataclass

import numpy as np

from depthtrack.hand.pose import ANGLES
from depthtrack.solver.options import LiftOptions, SurfaceFitOptions
from depthtrack.solver.prior import Prior
from depthtrack.tracking.candidate import Candidate
from depthtrack.tracking.frame import FrameContext


@dataclass(frozen=True)
class Lift:
    """Return the pose lifted from keypoints, or its surface fit if the energy is lower.

    There is no candidate without enough keypoints.

    fit: surface fit of the lifted pose; None for the lifted pose alone.
    """

    options: LiftOptions
    fit: SurfaceFitOptions | None
    name: str = "lift"

    def __call__(self, frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]:
        observation = frame.observation
        if observation.keypoints is None:
            return []
        lifter = frame.tools.lifter(self.options)
        lifted = lifter.lift(observation.keypoints, observation.camera, observation.depth, frame.last_pose)
        if lifted is None:
            return []
        poses = [lifted.pose]
        if self.fit is not None:
            prior = Prior.towards(lifted.pose[ANGLES], self.fit.icp.temporal_weight)
            poses.append(frame.fitter(self.fit).fit(lifted.pose, prior=prior))
        return frame.evaluate(np.stack(poses))
