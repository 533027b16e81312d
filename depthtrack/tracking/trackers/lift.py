"""The lift: a pose of each frame from the keypoints of another detector and the depth."""

from depthtrack.tracking.configuration import LiftConfig
from depthtrack.tracking.frame import Toolkit
from depthtrack.tracking.stage_tracker import Stages
from depthtrack.tracking.stages.lift import Lift
from depthtrack.tracking.stages.predict import GivenPose
from depthtrack.tracking.stages.surface_fit import SurfaceFit


def lift(config: LiftConfig, tools: Toolkit) -> Stages:
    """Return the stages of the lift.

    Each frame stands alone, but for a prior about the angles of the last one.
    """
    lifted = Lift(config.lift, config.fit if config.refine else None)
    return Stages(
        follow=[lifted], start=[lifted], refine=[GivenPose(), SurfaceFit(config.fit, hold_last=False, effort=2)]
    )
