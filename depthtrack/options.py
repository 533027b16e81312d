"""Options: frozen dataclasses whose fields have unit, meaning and source; JSON round trip.

This module imports neither numpy nor numba, so that `--help` is fast.
"""

import dataclasses
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, TypeVar, get_type_hints
from weakref import ref

from depthtrack.errors import InputError
from depthtrack.ranges import SEEDS, Range, range_of
from depthtrack.strict_data import exact_json_text, parse_json

T = TypeVar("T")

_MEANING, _UNIT, _SOURCE, _ADVANCED = "meaning", "unit", "source", "advanced"
_LEAST, _MOST = "least", "most"
_checked: dict[int, "ref[Any]"] = {}
"""Frozen groups whose ranges were checked, by their id; they stay right."""


def option(
    default: Any,
    meaning: str,
    *,
    unit: str = "",
    source: str = "",
    advanced: bool = False,
    least: float | None = None,
    most: float | None = None,
) -> Any:
    """Return a dataclass field with its documentation; a default dataclass is a nested group.

    least, most: ends of the range of a number, or of each of several ones. `ranges.range_of` states the usual ones.
    advanced: whether `--help` omits the option, or all options of the group.
    """
    metadata = {_MEANING: meaning, _UNIT: unit, _SOURCE: source, _ADVANCED: advanced, _LEAST: least, _MOST: most}
    if dataclasses.is_dataclass(default):
        return dataclasses.field(default_factory=lambda: default, metadata=metadata)
    return dataclasses.field(default=default, metadata=metadata)


@dataclass(frozen=True)
class Parameter:
    """One option of a configuration.

    path: dotted names of its groups and its field.
    name: the last part of the path if it is unique among all options, or among those not `advanced`; else the path.
    kind: its type.
    range: of a number; None of other types.
    """

    path: str
    name: str
    kind: Any
    default: Any
    meaning: str
    unit: str
    source: str
    advanced: bool
    range: Range | None


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
            documentation["range"] = _range(field, kinds[field.name])
            yield path, kinds[field.name], value, documentation


def check_ranges(configuration: Any) -> None:
    """Check that the numbers of a configuration and of the groups in it are within their ranges.

    Raises:
        InputError: if one is not.
    """
    if (checked := _checked.get(id(configuration))) is not None and checked() is configuration:
        return
    kind: Any = type(configuration)
    for name, found in _ranges(kind).items():
        value = getattr(configuration, name)
        if found is not None:
            found.check(value, name)
        for part in value if isinstance(value, tuple) else (value,):
            if dataclasses.is_dataclass(part):
                check_ranges(part)
    if kind.__dataclass_params__.frozen and hasattr(configuration, "__weakref__"):
        number = id(configuration)
        _checked[number] = ref(configuration, lambda _: _checked.pop(number, None))


@cache
def _ranges(kind: Any) -> dict[str, Range | None]:
    """Return the ranges of the options of a group by their names, None of options without one."""
    kinds = get_type_hints(kind)
    return {field.name: _range(field, kinds[field.name]) for field in dataclasses.fields(kind) if field.metadata}


def _range(field: dataclasses.Field[Any], kind: Any) -> Range | None:
    documentation = field.metadata
    return range_of(kind, documentation.get(_UNIT, ""), documentation.get(_LEAST), documentation.get(_MOST))


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
    from pydantic import ValidationError

    typed: Any = kind
    try:
        configuration: T = _adapter(typed).validate_python(data)
        check_ranges(configuration)
        return configuration
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(map(str, first["loc"])) or "it"
        raise InputError(f"{where}: {place[:80]}: {first['msg']}, found {first.get('input')!r:.60}") from error


@cache
def _adapter(kind: Any) -> Any:
    """Return what checks the types of plain data; making it takes longer than using it."""
    from pydantic import ConfigDict, TypeAdapter

    _forbid_extras(kind, ConfigDict(extra="forbid", strict=False))
    return TypeAdapter(kind)


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
    SEEDS.check(seed, "the seed")
