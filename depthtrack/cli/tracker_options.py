"""Find the run and the tracker that the arguments of a command name."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from depthtrack.errors import InputError
from depthtrack.tracking.configuration import CONFIGURATIONS, DEFAULT_TRACKER, MarkersConfig, TrackerConfig

if TYPE_CHECKING:
    from depthtrack.tracking.run_configuration import RunConfiguration


def requested_run(arguments: Sequence[str]) -> "RunConfiguration | None":
    """Return the configuration that `--config` names among the arguments, if any.

    Raises:
        InputError: if the file contains no configuration of a run.
    """
    path = _value(arguments, "--config")
    if path is None:
        return None
    from depthtrack.tracking.run_configuration import RunConfiguration

    return RunConfiguration.load(Path(path))


def requested_tracker(arguments: Sequence[str], run: "RunConfiguration | None") -> TrackerConfig:
    """Return the configuration of the tracker in the arguments, of the run, or the default.

    Raises:
        InputError: if no tracker has this name, or the run was solved from markers.
    """
    name = _value(arguments, "--tracker")
    if run is not None:
        if isinstance(run.tracker, MarkersConfig):
            raise InputError("--config names a run of markers, which has no images to track: name another run")
        if name in (None, run.tracker.name):
            return run.tracker
    if name is not None and name not in CONFIGURATIONS:
        raise InputError(f"no tracker '{name:.60}': choose one of {', '.join(CONFIGURATIONS)}")
    return CONFIGURATIONS[name or DEFAULT_TRACKER]()


def _value(arguments: Sequence[str], option: str) -> str | None:
    """Return the value of an option among the arguments before they are parsed."""
    found = None
    for number, argument in enumerate(arguments):
        if argument == option and number + 1 < len(arguments):
            found = arguments[number + 1]
        elif argument.startswith(f"{option}="):
            found = argument.partition("=")[2]
    return found
