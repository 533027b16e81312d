"""Derive command-line options from a configuration: names, defaults and help."""

import dataclasses
from collections.abc import Sequence
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

import tyro

from depthtrack.cli.stated_default import stated_default
from depthtrack.errors import InputError
from depthtrack.options import Parameter, parameters, to_data, with_options
from depthtrack.strict_data import exact_json_text, parse_json

T = TypeVar("T")

_PLAIN = (bool, int, float, str, NoneType)


def options_type(config: Any, arguments: Sequence[str], prefix: str = "") -> type[Any]:
    """Return a frozen dataclass with one field per option of `config`, with its defaults.

    arguments: those of the command; if they ask for help, advanced options are left out of it.
    prefix: start of the names of the options on the command line.
    """
    # tyro cannot parse an option that it does not list.
    hidden = not {"-h", "--help"}.isdisjoint(arguments)
    fields = [(_field_name(each), _annotation(each, prefix, hidden), _default(each)) for each in parameters(config)]
    return dataclasses.make_dataclass("Options", fields, frozen=True)


def chosen_config(config: T, chosen: Any, prefix: str = "") -> T:
    """Return `config` with the options that the command line changed.

    chosen: instance of the type that `options_type` returned.

    Raises:
        InputError: if a value is out of range, or is not JSON although its type needs it.
    """
    changed = {}
    for each in parameters(config):
        value = getattr(chosen, _field_name(each))
        if value != _default(each):
            changed[each.path] = value if _is_plain(each.kind) else _parsed(each, value, prefix)
    return with_options(config, changed)


def _field_name(parameter: Parameter) -> str:
    return parameter.path.replace(".", "__")


def _annotation(parameter: Parameter, prefix: str, hidden: bool) -> Any:
    """Return the type of a field with its names and help; `hidden` suppresses advanced options."""
    flag = parameter.name.replace("_", "-")
    unit, source = (
        f" [{parameter.unit}]" if parameter.unit else "",
        f" ({parameter.source})" if parameter.source else "",
    )
    path = parameter.path.replace("_", "-")
    aliases = (f"--{prefix}{path}",) if "." in path and flag != path else ()
    plain = _is_plain(parameter.kind)
    text = f"{parameter.meaning}{unit}.{source}"
    argument = stated_default(parameter.range if plain else None, name=prefix + flag, aliases=aliases, help=text)
    kind = parameter.kind if plain else str
    if parameter.advanced and hidden:
        return Annotated[kind, tyro.conf.Suppress, argument]
    return Annotated[kind, argument]


def _default(parameter: Parameter) -> Any:
    return parameter.default if _is_plain(parameter.kind) else exact_json_text(_data(parameter.default))


def _data(value: Any) -> Any:
    if dataclasses.is_dataclass(value):
        return to_data(value)
    return [_data(part) for part in value] if isinstance(value, tuple | list) else value


def _parsed(parameter: Parameter, text: str, prefix: str) -> Any:
    try:
        return parse_json(text)
    except ValueError as error:
        raise InputError(f"--{prefix}{parameter.name}: expected JSON, found {text!r:.60}") from error


def _is_plain(kind: Any) -> bool:
    """Return whether the command line can parse this type without JSON."""
    origin, parts = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        return all(map(_is_plain, parts))
    if origin is tuple:
        return all(part in _PLAIN or part is Ellipsis for part in parts)
    return origin is Literal or kind in _PLAIN
