"""The trackers by name; none is imported before it is asked for."""

from importlib import import_module
from typing import Any

from depthtrack.errors import InputError
from depthtrack.hand.shape import HandShape
from depthtrack.tracking.tracker import Tracker

TRACKERS: dict[str, tuple[str, str, str]] = {
    "pso": ("depthtrack.tracking.pso.tracker", "PsoTracker", "PsoOptions"),
    "ik": ("depthtrack.tracking.ik.tracker", "IkTracker", "IkOptions"),
}
"""Module, tracker and options of each."""


def create_tracker(name: str, hand: HandShape, **options: Any) -> Tracker:
    """A tracker of a hand; `options` as its options class documents them.

    Raises InputError for a name or an option that does not exist.
    """
    if name not in TRACKERS:
        raise InputError(f"no tracker '{name}': choose one of {', '.join(TRACKERS)}")
    module_name, tracker, options_class = TRACKERS[name]
    module = import_module(module_name)
    try:
        chosen = getattr(module, options_class)(**options)
    except TypeError as error:
        raise InputError(f"tracker '{name}' cannot be made like that: {error}") from error
    made: Tracker = getattr(module, tracker)(hand, chosen)
    return made
