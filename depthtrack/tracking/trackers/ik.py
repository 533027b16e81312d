"""The IK tracker: fits of the hand's surface to the point cloud (Schroeder et al. 2014)."""

from dataclasses import replace

from depthtrack.solver.prior import Prior
from depthtrack.solver.subspace import PostureSubspace
from depthtrack.tracking.configuration import IkConfig
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
from depthtrack.tracking.stages.surface_fit import RetryPredictions, SurfaceFit


def ik(config: IkConfig, tools: Toolkit) -> Stages:
    """Return the stages of the IK tracker.

    They fit all angles, all angles with a synergy prior, or synergies alone.
    """
    config = replace(config, fit=for_hand(config.fit, tools.hand))
    if config.synergies.synergies is None:
        return _all_angles(config)
    return _synergy_prior(config, tools) if config.synergies.synergy_prior else _synergies_alone(config, tools)


def _all_angles(config: IkConfig) -> Stages:
    """Return the stages without synergies.

    Frames that fit poorly trigger fits of the other predictions, then searches. Branches are followed beside.
    """
    fit = SurfaceFit(config.fit)
    search, near = FitSearch(config.fit_search, config.fit), FitSearch(config.local_search, config.fit)
    fingers = RefineFingers(near, config.recovery, config.fingers, refit=config.fit)
    keypoints = KeypointProposals(config.keypoints, config.fit)
    search_globally = SearchGlobally if config.deadline is None else SearchInParts
    start: list[Stage] = [search_globally(search, config.search), keypoints, fingers]
    doubt, routine = FitSearch(config.doubt_search, config.fit), FitSearch(config.routine_search, config.fit)
    elsewhere: list[Stage] = [search_globally(doubt, replace(config.search, attempts=1)), keypoints, fingers]
    return Stages(
        follow=[
            Predict(config.predictions),
            fit,
            RetryPredictions(fit, config.retry_ratio, config.retry_energy),
            keypoints,
            RecoverLocally(near, config.recovery, elsewhere, routine),
            fingers,
            CarryBranches(config.branches, config.fit),
        ],
        start=[Reinitialise(routine, config.recovery.routine, config.search, [keypoints, fingers], elsewhere, start)],
        refine=[GivenPose(), replace(fit, effort=2)],
    )


def _synergy_prior(config: IkConfig, tools: Toolkit) -> Stages:
    """Return the stages that fit all angles with a prior from synergies."""
    fit = SurfaceFit(config.fit, Prior.from_synergies(tools.synergies, config.fit.icp.synergy_weight))
    near = FitSearch(config.local_search, config.fit)
    start: list[Stage] = [SearchGlobally(FitSearch(config.fit_search, config.fit), config.search), fit]
    return Stages(
        follow=[
            Predict(config.predictions),
            fit,
            RetryPredictions(fit, config.retry_ratio, config.retry_energy),
            RecoverLocally(near, config.recovery, elsewhere=start),
        ],
        start=start,
        refine=[GivenPose(), replace(fit, effort=2)],
    )


def _synergies_alone(config: IkConfig, tools: Toolkit) -> Stages:
    """Return the stages that fit pose and synergies (Schroeder et al. 2014, Sec. V-A).

    Their steps align the hand as well.
    """
    prior = Prior.from_synergies(tools.synergies, config.fit.icp.synergy_weight)
    fit = SurfaceFit(config.fit, prior, subspace=PostureSubspace.of(tools.synergies))
    return Stages(
        follow=[Predict(config.predictions), replace(fit, align=False)],
        start=[SearchGlobally(FitSearch(config.fit_search, config.fit), config.search), fit],
        refine=[GivenPose(), replace(fit, effort=2)],
    )
