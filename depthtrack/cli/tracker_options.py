"""Derive the command-line options of a tracker from its configuration."""

import dataclasses
import json
from collections.abc import Sequence
from pathlib import Path
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_args, get_origin

import tyro

from depthtrack.errors import InputError
from depthtrack.options import Parameter, parameters, to_data, with_options
from depthtrack.tracking.configuration import CONFIGURATIONS, DEFAULT_TRACKER, TrackerConfig

if TYPE_CHECKING:
    from depthtrack.tracking.run_configuration import RunConfiguration

_PLAIN = (bool, int, float, str, NoneType)


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
        InputError: if no tracker has this name.
    """
    name = _value(arguments, "--tracker")
    if run is not None and name in (None, run.tracker.name):
        return run.tracker
    if name is not None and name not in CONFIGURATIONS:
        raise InputError(f"no tracker '{name:.60}': choose one of {', '.join(CONFIGURATIONS)}")
    return CONFIGURATIONS[name or DEFAULT_TRACKER]()


def options_type(config: TrackerConfig) -> type[Any]:
    """Return a frozen dataclass with one field per option of `config`, with its defaults."""
    fields = [(_field_name(each), _annotation(each), _default(each)) for each in parameters(config)]
    return dataclasses.make_dataclass("TrackerOptions", fields, frozen=True)


def chosen_config(config: TrackerConfig, chosen: Any) -> TrackerConfig:
    """Return `config` with the options that the command line changed.

    Raises:
        InputError: if a value is out of range, or is not JSON although its type needs it.
    """
    changed = {}
    for each in parameters(config):
        value = getattr(chosen, _field_name(each))
        if value != _default(each):
            changed[each.path] = value if _is_plain(each.kind) else _parsed(each, value)
    return with_options(config, changed)


def _field_name(parameter: Parameter) -> str:
    return parameter.path.replace(".", "__")


def _annotation(parameter: Parameter) -> Any:
    """Return the type of a field with its names and help; advanced options are not listed."""
    flag = parameter.name.replace("_", "-")
    unit, source = (
        f" [{parameter.unit}]" if parameter.unit else "",
        f" ({parameter.source})" if parameter.source else "",
    )
    aliases = (f"--{parameter.path.replace('_', '-')}",) if "." in parameter.path and flag != parameter.path else ()
    argument = tyro.conf.arg(name=flag, aliases=aliases, help=f"{parameter.meaning}{unit}.{source}")
    kind = parameter.kind if _is_plain(parameter.kind) else str
    if parameter.advanced:
        return Annotated[kind, tyro.conf.Suppress, argument]
    return Annotated[kind, argument]


def _default(parameter: Parameter) -> Any:
    return parameter.default if _is_plain(parameter.kind) else json.dumps(_data(parameter.default))


def _data(value: Any) -> Any:
    if dataclasses.is_dataclass(value):
        return to_data(value)
    return [_data(part) for part in value] if isinstance(value, tuple | list) else value


def _parsed(parameter: Parameter, text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError as error:
        raise InputError(f"--{parameter.name}: expected JSON, found {text!r:.60}") from error


def _is_plain(kind: Any) -> bool:
    """Return whether the command line can parse this type without JSON."""
    origin, parts = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        return all(map(_is_plain, parts))
    if origin is tuple:
        return all(part in _PLAIN or part is Ellipsis for part in parts)
    return origin is Literal or kind in _PLAIN


def _value(arguments: Sequence[str], option: str) -> str | None:
    """Return the value of an option among the arguments before they are parsed."""
    found = None
    for number, argument in enumerate(arguments):
        if argument == option and number + 1 < len(arguments):
            found = arguments[number + 1]
        elif argument.startswith(f"{option}="):
            found = argument.partition("=")[2]
    return found
