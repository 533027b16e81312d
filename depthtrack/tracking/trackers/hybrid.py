"""The hybrid tracker: surface fits, and a small swarm with fits of its best particles.

Rendering verifies the fits.
"""

from dataclasses import replace

from depthtrack.tracking.configuration import HybridConfig
from depthtrack.tracking.frame import Toolkit
from depthtrack.tracking.posture_prior import for_hand
from depthtrack.tracking.stage_tracker import Stages
from depthtrack.tracking.stages.branches import CarryBranches
from depthtrack.tracking.stages.keypoint_proposals import KeypointProposals
from depthtrack.tracking.stages.predict import GivenPose, Predict
from depthtrack.tracking.stages.recover import RecoverLocally, RefineFingers, Reinitialise, SearchGlobally
from depthtrack.tracking.stages.search_in_parts import SearchInParts
from depthtrack.tracking.stages.searches import FitSearch
from depthtrack.tracking.stages.stage import Stage
from depthtrack.tracking.stages.surface_choice import FitChosenSurface
from depthtrack.tracking.stages.surface_fit import RetryPredictions, SurfaceFit
from depthtrack.tracking.stages.swarm_proposals import SwarmProposals


def hybrid(config: HybridConfig, tools: Toolkit) -> Stages:
    """Return the stages of the hybrid tracker.

    The surface that the observed points lie on is chosen in each frame. The best prediction is fitted to it, then the
    best particles of a small swarm; rendering decides. Frames that fit poorly trigger searches. Branches are followed.
    """
    config = replace(config, fit=for_hand(config.fit, tools.hand))
    fit = SurfaceFit(config.fit)
    chosen = FitChosenSurface(config.surface_choice, fit)
    limits = [limit for limit in (config.fit.max_points, config.search_points) if limit > 0]
    sparse = replace(config.fit, max_points=min(limits, default=0))
    search, near = FitSearch(config.fit_search, sparse), FitSearch(config.local_search, sparse)
    routine = FitSearch(config.routine_search, sparse)
    in_turn = RefineFingers(near, config.recovery, config.fingers, refit=sparse)
    fingers = replace(in_turn, options=replace(config.fingers, turns=1, usual_turns=1))
    keypoints = KeypointProposals(config.keypoints, sparse)
    search_globally = SearchGlobally if config.deadline is None else SearchInParts
    start: list[Stage] = [search_globally(search, config.search), keypoints, chosen, fingers]
    doubt = FitSearch(config.doubt_search, sparse)
    elsewhere: list[Stage] = [search_globally(doubt, replace(config.search, attempts=1)), keypoints, chosen, fingers]
    return Stages(
        follow=[
            Predict(config.predictions),
            chosen,
            RetryPredictions(fit, config.retry_ratio, config.retry_energy),
            SwarmProposals(config.proposals, fit),
            keypoints,
            RecoverLocally(near, config.recovery, elsewhere=elsewhere, routine=routine),
            in_turn,
            CarryBranches(config.branches, sparse),
        ],
        start=[
            Reinitialise(
                routine,
                config.recovery.routine,
                config.search,
                fit=[keypoints, chosen, fingers],
                elsewhere=elsewhere,
                start=start,
            )
        ],
        refine=[GivenPose(), replace(chosen, fit=replace(fit, effort=2))],
    )
