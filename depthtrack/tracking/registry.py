"""The trackers by name; none is imported before it is made."""

from importlib import import_module
from typing import Any

from depthtrack.errors import InputError
from depthtrack.hand.shape import HandShape
from depthtrack.hand.synergies import Synergies, load_synergies
from depthtrack.options import with_options
from depthtrack.tracking.configuration import (
    CONFIGURATIONS,
    HybridConfig,
    IkConfig,
    MarkersConfig,
    RunConfig,
    TrackerConfig,
)
from depthtrack.tracking.frame import Toolkit
from depthtrack.tracking.stage_tracker import StageTracker

_TRACKERS = "depthtrack.tracking.trackers"
BUILDERS = {
    "hybrid": f"{_TRACKERS}.hybrid",
    "pso": f"{_TRACKERS}.pso",
    "ik": f"{_TRACKERS}.ik",
    "oikonomidis2011": f"{_TRACKERS}.papers",
    "schroeder2014": f"{_TRACKERS}.papers",
    "lift": f"{_TRACKERS}.lift",
}
"""Module with a function of the tracker's name that returns its `Stages`."""


def tracker_config(name: str, **options: Any) -> TrackerConfig:
    """Return the configuration of a tracker.

    options: values by name or dotted path, as `options.parameters` lists them.

    Raises:
        InputError: if no tracker has this name, or if an option does not exist or has the wrong type.
    """
    if name not in CONFIGURATIONS:
        raise InputError(f"no tracker '{name:.60}': choose one of {', '.join(CONFIGURATIONS)}")
    return with_options(CONFIGURATIONS[name](), options)


def create_tracker(
    config: RunConfig, hand: HandShape, threads: int = 1, synergies: Synergies | None = None
) -> StageTracker:
    """Return a tracker of a hand.

    threads: threads of renderer and fits; poses do not depend on it.
    synergies: synergies in place of those that the configuration names.

    Raises:
        InputError: if a file of synergies cannot be read, or no skin fits the sizes of the hand. A run of markers has
            no tracker.
    """
    if isinstance(config, MarkersConfig):
        raise InputError("a run of markers has no images to track: name another tracker")
    chosen = getattr(config, "synergies", None)
    if synergies is None and chosen is not None and chosen.synergies is not None:
        synergies = load_synergies(chosen.synergies)
    if synergies is not None and chosen is not None and chosen.components is not None:
        synergies = synergies.truncated(chosen.components)
    tools = Toolkit(hand, config.scoring, threads, synergies)
    stages = getattr(import_module(BUILDERS[config.name]), config.name)(config, tools)
    deadline = None
    if isinstance(config, HybridConfig | IkConfig) and config.deadline is not None:
        deadline = (1 - config.deadline_reserve) * config.deadline
    return StageTracker(config.name, stages, tools, config.thresholds, config.seed, deadline)
