"""Options: frozen dataclasses whose fields have unit, meaning and source; JSON round trip.

This module imports neither numpy nor numba, so that `--help` is fast.
"""

import dataclasses
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar, get_type_hints

from depthtrack.errors import InputError
from depthtrack.strict_data import exact_json_text, parse_json

T = TypeVar("T")

_MEANING, _UNIT, _SOURCE, _ADVANCED = "meaning", "unit", "source", "advanced"


def option(default: Any, meaning: str, *, unit: str = "", source: str = "", advanced: bool = False) -> Any:
    """Return a dataclass field with its documentation; a default dataclass is a nested group.

    advanced: whether `--help` omits the option, or all options of the group.
    """
    metadata = {_MEANING: meaning, _UNIT: unit, _SOURCE: source, _ADVANCED: advanced}
    if dataclasses.is_dataclass(default):
        return dataclasses.field(default_factory=lambda: default, metadata=metadata)
    return dataclasses.field(default=default, metadata=metadata)


@dataclass(frozen=True)
class Parameter:
    """One option of a configuration.

    path: dotted names of its groups and its field.
    name: the last part of the path if it is unique among all options, or among those not `advanced`; else the path.
    kind: its type.
    """

    path: str
    name: str
    kind: Any
    default: Any
    meaning: str
    unit: str
    source: str
    advanced: bool


def parameters(configuration: Any) -> list[Parameter]:
    """Return all options of a configuration, in order, with its values as defaults."""
    found = list(_leaves(configuration, ""))
    last = [path.rpartition(".")[2] for path, *_ in found]
    listed = [name for name, (*_, documentation) in zip(last, found, strict=True) if not documentation[_ADVANCED]]

    def short(name: str, advanced: bool) -> bool:
        return last.count(name) == 1 or (not advanced and listed.count(name) == 1)

    return [
        Parameter(path, name if short(name, documentation[_ADVANCED]) else path, kind, value, **documentation)
        for (path, kind, value, documentation), name in zip(found, last, strict=True)
    ]


def _leaves(group: Any, prefix: str, advanced: bool = False) -> Iterator[tuple[str, Any, Any, dict[str, Any]]]:
    kinds = get_type_hints(type(group))
    for field in dataclasses.fields(group):
        value, path = getattr(group, field.name), prefix + field.name
        if dataclasses.is_dataclass(value) and field.metadata:
            yield from _leaves(value, f"{path}.", advanced or field.metadata[_ADVANCED])
        else:
            documentation: dict[str, Any] = {key: field.metadata.get(key, "") for key in (_MEANING, _UNIT, _SOURCE)}
            documentation[_ADVANCED] = advanced or bool(field.metadata.get(_ADVANCED))
            yield path, kinds[field.name], value, documentation


def with_options(configuration: T, values: Mapping[str, Any]) -> T:
    """Return the configuration with some options replaced, named by `Parameter.name` or path.

    Raises:
        InputError: if an option does not exist, or a value has the wrong type.
    """
    known = parameters(configuration)
    paths = {parameter.path: parameter for parameter in known} | {parameter.name: parameter for parameter in known}
    data = to_data(configuration)
    for name, value in values.items():
        if name not in paths:
            names = ", ".join(parameter.name for parameter in known if not parameter.advanced)
            raise InputError(f"there is no option '{name:.60}': choose among {names}, or see docs/parameters.md")
        *groups, last = paths[name].path.split(".")
        target = data
        for group in groups:
            target = target[group]
        target[last] = to_data(value) if dataclasses.is_dataclass(value) else value
    return from_data(type(configuration), data, "options")


def to_data(configuration: Any) -> dict[str, Any]:
    """Return nested plain dictionaries, lists, numbers and strings of a configuration."""
    data: dict[str, Any] = parse_json(to_json(configuration))
    return data


def to_json(configuration: Any) -> str:
    """Return a configuration as JSON; `from_data` of it gives an equal configuration."""
    return exact_json_text(_strict(dataclasses.asdict(configuration)), indent=2)


def _strict(value: Any) -> Any:
    """Replace numbers that strict JSON lacks by their names, which `from_data` accepts."""
    if isinstance(value, dict):
        return {key: _strict(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_strict(part) for part in value]
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def from_data(kind: type[T], data: Any, where: str) -> T:
    """Return the configuration of plain data; absent options keep their defaults.

    Raises:
        InputError: if an option is unknown, or a value has the wrong type or range; it names `where`.
    """
    from pydantic import ConfigDict, TypeAdapter, ValidationError

    strict = ConfigDict(extra="forbid", strict=False)
    _forbid_extras(kind, strict)
    try:
        return TypeAdapter(kind).validate_python(data)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(map(str, first["loc"])) or "it"
        raise InputError(f"{where}: {place[:80]}: {first['msg']}, found {first.get('input')!r:.60}") from error


def _forbid_extras(kind: Any, configuration: Any) -> None:
    """Make pydantic reject unknown options in a dataclass and in the groups inside it."""
    if not dataclasses.is_dataclass(kind):
        return
    kind.__pydantic_config__ = configuration  # type: ignore[union-attr]
    for nested in get_type_hints(kind).values():
        for part in (nested, *getattr(nested, "__args__", ())):
            if dataclasses.is_dataclass(part) and "__pydantic_config__" not in vars(part):
                _forbid_extras(part, configuration)


def check_seed(seed: int) -> None:
    """Check the seed of random numbers.

    Raises:
        InputError: if it is not within 0 to 2^63 - 1.
    """
    if not 0 <= seed < 2**63:
        raise InputError(f"the seed must be a whole number from 0 to 2^63 - 1, found {seed}")
