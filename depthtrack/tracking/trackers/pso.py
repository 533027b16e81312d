"""The PSO tracker: a swarm of rendered hypotheses per frame (Oikonomidis et al. 2011)."""

from dataclasses import replace

from depthtrack.tracking.configuration import PsoConfig
from depthtrack.tracking.frame import Toolkit
from depthtrack.tracking.posture_prior import for_hand
from depthtrack.tracking.stage_tracker import Stages
from depthtrack.tracking.stages.branches import CarryBranches
from depthtrack.tracking.stages.keypoint_proposals import KeypointProposals
from depthtrack.tracking.stages.predict import GivenPose
from depthtrack.tracking.stages.recover import RecoverLocally, RefineFingers, Reinitialise, SearchGlobally
from depthtrack.tracking.stages.searches import SwarmSearch
from depthtrack.tracking.stages.stage import Stage
from depthtrack.tracking.stages.surface_choice import FitChosenSurface
from depthtrack.tracking.stages.surface_fit import SurfaceFit
from depthtrack.tracking.stages.swarm import Swarm, SwarmAround


def pso(config: PsoConfig, tools: Toolkit) -> Stages:
    """Return the stages of the PSO tracker.

    The swarm starts from the last pose, its linear prediction and the observed hand. Frames that fit poorly trigger a
    search near the pose, then of single fingers; searches fit surfaces between their rounds. Branches are followed.
    """
    config = replace(config, final_fit=for_hand(config.final_fit, tools.hand))
    search = SwarmSearch(config.swarm_search)
    fingers = RefineFingers(search, config.recovery, config.fingers)
    keypoints = KeypointProposals(config.keypoints, config.final_fit)
    doubt, routine = SwarmSearch(config.doubt_search), SwarmSearch(config.routine_search)
    start: list[Stage] = [SearchGlobally(search, config.search), keypoints, fingers]
    elsewhere: list[Stage] = [SearchGlobally(doubt, replace(config.search, attempts=1)), keypoints, fingers]
    refine: list[Stage] = (
        [FitChosenSurface(config.surface_choice, SurfaceFit(config.final_fit))] if config.refine else []
    )
    return Stages(
        follow=[
            Swarm(config.swarm, config.spread, widen=config.widen),
            keypoints,
            RecoverLocally(search, config.recovery, routine=routine),
            fingers,
            *refine,
            CarryBranches(config.branches, config.swarm_search.fit),
        ],
        start=[
            Reinitialise(routine, config.recovery.routine, config.search, [keypoints, fingers], elsewhere, start),
            *refine,
        ],
        refine=[GivenPose(), SwarmAround(config.swarm, config.spread), *refine],
    )
