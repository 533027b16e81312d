"""The trackers by name; none is imported before it is asked for."""

from dataclasses import fields
from importlib import import_module
from typing import Any

from depthtrack.errors import InputError
from depthtrack.hand.shape import HandShape
from depthtrack.tracking.tracker import Tracker

TRACKERS: dict[str, tuple[str, str, str]] = {
    "pso": ("depthtrack.tracking.trackers.pso", "PsoTracker", "PsoOptions"),
    "ik": ("depthtrack.tracking.trackers.ik", "IkTracker", "IkOptions"),
}
"""Module, tracker and options of each."""


def complete_options(name: str, given: dict[str, Any]) -> dict[str, Any]:
    """Options given by name, and the defaults of the others as far as they are plain values: what a run must tell to
    be made again. Raises InputError as `create_tracker` does."""
    made = _options(name, given)
    plain = {field.name: getattr(made, field.name) for field in fields(made)}
    return {
        name: value for name, value in plain.items() if value is None or isinstance(value, bool | int | float | str)
    }


def create_tracker(name: str, hand: HandShape, **options: Any) -> Tracker:
    """A tracker of a hand; `options` as its options class documents them.

    Raises InputError for a name or an option that does not exist.
    """
    chosen = _options(name, options)
    module_name, tracker, _ = TRACKERS[name]
    made: Tracker = getattr(import_module(module_name), tracker)(hand, chosen)
    return made


def _options(name: str, given: dict[str, Any]) -> Any:
    if name not in TRACKERS:
        raise InputError(f"no tracker '{name}': choose one of {', '.join(TRACKERS)}")
    module_name, _, options_class = TRACKERS[name]
    try:
        return getattr(import_module(module_name), options_class)(**given)
    except TypeError as error:
        raise InputError(f"tracker '{name}' cannot be made like that: {error}") from error
