"""Who takes part in a comparison: trackers with options, read from the command line or from a small TOML file."""

import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from depthtrack.errors import InputError
from depthtrack.files import read_text
from depthtrack.tracking.registry import TRACKERS, complete_options

_COMPARISONS = ("seed", "threads")
"""Options that the comparison chooses."""
_PLAIN = (bool, int, float, str, NoneType)


@dataclass(frozen=True)
class TrackerSpec:
    """A tracker that takes part: its name and options, under a `label` of its own."""

    label: str
    tracker: str
    options: dict[str, Any] = field(default_factory=dict)

    @property
    def complete_options(self) -> dict[str, Any]:
        """The options with those that were left to their defaults: what a run must tell to be made again."""
        complete = complete_options(self.tracker, self.options)
        return {name: value for name, value in complete.items() if name not in _COMPARISONS}

    @property
    def slug(self) -> str:
        """The label as a part of file names."""
        return re.sub(r"[^a-z0-9.=]+", "-", self.label.lower()).strip("-") or "tracker"


def read_specs(texts: Sequence[str]) -> list[TrackerSpec]:
    """Contenders as people write them: `pso,ik:variant=paper,rounds=3`, or the path of a TOML file.

    In the file, a table for each: its heading is the label, `tracker` names the tracker, the rest are options. Raises
    InputError for trackers and options that do not exist, values of the wrong kind, and labels that are not unique.
    """
    found: list[TrackerSpec] = []
    for text in texts:
        found += _from_file(Path(text)) if text.endswith(".toml") else _from_text(text)
    if not found:
        raise InputError(f"name at least one tracker: {', '.join(TRACKERS)}")
    for number, spec in enumerate(found):
        if spec.slug in {other.slug for other in found[:number]}:
            raise InputError(f"two trackers are called '{spec.label}': give them different labels or options")
    return found


def _from_text(text: str) -> list[TrackerSpec]:
    parts: list[tuple[str, dict[str, Any]]] = []
    for piece in filter(None, (piece.strip() for piece in text.split(","))):
        # A comma also stands between options: what has no tracker's name before it belongs to the tracker before it.
        name, colon, option = piece.partition(":") if "=" not in piece.partition(":")[0] else ("", ":", piece)
        if name:
            parts.append((name.strip(), {}))
        if colon:
            key, equals, value = option.partition("=")
            if not equals or not parts:
                raise InputError(f"write a tracker's options as in ik:variant=paper,rounds=3; found '{piece}'")
            parts[-1][1][key.strip()] = _value(value.strip())
    return [_checked(" ".join([name.upper(), *(f"{k}={v}" for k, v in o.items())]), name, o) for name, o in parts]


def _from_file(path: Path) -> list[TrackerSpec]:
    try:
        tables = tomllib.loads(read_text(path))
    except (InputError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(f"cannot read the trackers in {path}: {error}") from error
    found = []
    for label, table in tables.items():
        if not isinstance(table, dict) or not isinstance(table.get("tracker"), str):
            raise InputError(f'{path}: expected a table for each tracker, with  tracker = "pso"; found {label!r}')
        options = {name: value for name, value in table.items() if name != "tracker"}
        found.append(_checked(label, table["tracker"], options))
    return found


def _value(text: str) -> Any:
    """A value as TOML has it, where it is one; else the text itself, so that strings need no quotes."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def _checked(label: str, tracker: str, options: dict[str, Any]) -> TrackerSpec:
    if tracker not in TRACKERS:
        raise InputError(f"no tracker '{tracker}': choose among {', '.join(TRACKERS)}")
    kinds = _settable(tracker)
    for name, value in options.items():
        if name not in kinds:
            raise InputError(f"{tracker} has no option '{name}' to set here: choose among {', '.join(kinds)}")
        if not any(_fits(value, kind) for kind in _alternatives(kinds[name])):
            wanted = " or ".join(str(getattr(kind, "__name__", kind)) for kind in _alternatives(kinds[name]))
            raise InputError(f"{tracker}: option {name} must be {wanted}, found {value!r}")
    return TrackerSpec(label, tracker, options)


def _settable(tracker: str) -> dict[str, Any]:
    """Options with plain values, and their types."""
    module, _, name = TRACKERS[tracker]
    options = getattr(import_module(module), name)
    hints = {name: kind for name, kind in get_type_hints(options).items() if name not in _COMPARISONS}
    return {name: kind for name, kind in hints.items() if any(_is_plain(each) for each in _alternatives(kind))}


def _alternatives(kind: Any) -> tuple[Any, ...]:
    """The types that a union or a Literal allows; a Literal's values stand for themselves."""
    if get_origin(kind) in (Union, UnionType):
        return tuple(each for part in get_args(kind) for each in _alternatives(part))
    return get_args(kind) if get_origin(kind) is Literal else (kind,)


def _is_plain(kind: Any) -> bool:
    """Whether such values can be written; None alone says nothing."""
    return (kind in _PLAIN and kind is not NoneType) or isinstance(kind, str)


def _fits(value: Any, kind: Any) -> bool:
    if isinstance(kind, str):
        return bool(value == kind)
    if kind is float:
        return isinstance(value, int | float) and not isinstance(value, bool)
    return type(value) is kind
