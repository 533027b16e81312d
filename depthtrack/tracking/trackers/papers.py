"""The trackers as their papers describe them: no recovery, no surface fit in PSO, no rendering in IK's fit."""

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
    """Return the stages of Oikonomidis et al. 2011, Sec. 2.4: one swarm around the last solution."""
    return Stages(
        follow=[Swarm(config.swarm, config.spread, space="parameters")],
        start=[SearchGlobally(SwarmSearch(config.swarm_search), config.search)],
        refine=[GivenPose(), SwarmAround(config.swarm, config.spread)],
    )


def schroeder2014(config: Schroeder2014Config, tools: Toolkit) -> Stages:
    """Return the stages of Schroeder et al. 2014, Sec. IV and V: linear prediction, then one fit."""
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
