"""The trackers as in their papers.

They have no recovery. The PSO tracker has no surface fit, and the IK tracker no rendering in its fit.
"""

from dataclasses import replace

from depthtrack.solver.prior import Prior
from depthtrack.solver.subspace import FULL, PostureSubspace
from depthtrack.tracking.configuration import Oikonomidis2011Config, Schroeder2014Config
from depthtrack.tracking.frame import Toolkit
from depthtrack.tracking.stage_tracker import Stages
from depthtrack.tracking.stages.predict import GivenPose, Predict
from depthtrack.tracking.stages.recover import SearchGlobally
from depthtrack.tracking.stages.searches import FitSearch, SwarmSearch
from depthtrack.tracking.stages.stage import Stage
from depthtrack.tracking.stages.surface_fit import SurfaceFit
from depthtrack.tracking.stages.swarm import Swarm, SwarmAround


def oikonomidis2011(config: Oikonomidis2011Config, tools: Toolkit) -> Stages:
    """Return the stages of Oikonomidis et al. 2011, Sec. 2.4.

    One swarm searches around the last solution.
    """
    return Stages(
        follow=[Swarm(config.swarm, config.spread, space="parameters")],
        start=[SearchGlobally(SwarmSearch(config.swarm_search), config.search)],
        refine=[GivenPose(), SwarmAround(config.swarm, config.spread)],
    )


def schroeder2014(config: Schroeder2014Config, tools: Toolkit) -> Stages:
    """Return the stages of Schroeder et al. 2014, Sec. IV and V.

    One fit starts from the linear prediction.
    """
    fit, given = SurfaceFit(config.fit), config.synergies.synergies is not None
    if given:
        subspace = FULL if config.synergies.synergy_prior else PostureSubspace.of(tools.synergies)
        fit = replace(
            fit, prior=Prior.from_synergies(tools.synergies, config.fit.icp.synergy_weight), subspace=subspace
        )
    search: Stage = SearchGlobally(FitSearch(config.fit_search, config.fit), config.search)
    return Stages(
        follow=[Predict((1.0,)), fit],
        start=[search, fit] if given else [search],
        refine=[GivenPose(), replace(fit, hold_last=False, effort=2)],
    )
