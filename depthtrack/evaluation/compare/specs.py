"""Read the trackers of a comparison and their options from text or a TOML file."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from depthtrack.errors import InputError
from depthtrack.files import read_text
from depthtrack.options import parameters
from depthtrack.strict_data import parse_toml
from depthtrack.tracking.configuration import CONFIGURATIONS, RUN_CONFIGURATIONS, RunConfig, TrackerConfig
from depthtrack.tracking.registry import tracker_config


@dataclass(frozen=True)
class TrackerSpec:
    """Label and configuration of a tracker in a comparison."""

    label: str
    config: TrackerConfig

    @property
    def slug(self) -> str:
        """Label as a part of file names."""
        return re.sub(r"[^a-z0-9.=]+", "-", self.label.lower()).strip("-") or "tracker"


def read_specs(texts: Sequence[str]) -> list[TrackerSpec]:
    """Return the trackers in texts such as `pso,ik:icp_iterations=3`, or in TOML files.

    A file has one table per tracker. Its heading is the label, `tracker` names the tracker, and the rest are options.

    Raises:
        InputError: if a tracker or option does not exist, a value has the wrong type, or two labels are equal.
    """
    found: list[TrackerSpec] = []
    for text in texts:
        found += _from_file(Path(text)) if text.endswith(".toml") else _from_text(text)
    if not found:
        raise InputError(f"name at least one tracker: {', '.join(CONFIGURATIONS)}")
    for number, spec in enumerate(found):
        if spec.slug in {other.slug for other in found[:number]}:
            raise InputError(f"two trackers have the label '{spec.label}': give them different labels or options")
    return found


def label_of(config: RunConfig) -> str:
    """Return the name of a tracker and its options that differ from the defaults, without seed."""
    defaults = {each.path: each.default for each in parameters(RUN_CONFIGURATIONS[config.name]())}
    changed = [each for each in parameters(config) if each.default != defaults[each.path] and each.path != "seed"]
    return " ".join([config.name.upper(), *(f"{each.name}={each.default}" for each in changed)])


def _from_text(text: str) -> list[TrackerSpec]:
    parts: list[tuple[str, dict[str, Any]]] = []
    for piece in filter(None, (piece.strip() for piece in text.split(","))):
        # A comma also separates options: a piece without tracker belongs to the tracker before it.
        name, colon, option = piece.partition(":") if "=" not in piece.partition(":")[0] else ("", ":", piece)
        if name:
            parts.append((name.strip(), {}))
        if colon:
            key, equals, value = option.partition("=")
            if not equals or not parts:
                raise InputError(f"expected options as in ik:icp_iterations=3,subsample=2, found '{piece}'")
            parts[-1][1][key.strip()] = _value(value.strip())
    return [
        TrackerSpec(" ".join([name.upper(), *(f"{k}={v}" for k, v in o.items())]), _config(name, o))
        for name, o in parts
    ]


def _from_file(path: Path) -> list[TrackerSpec]:
    try:
        tables = parse_toml(read_text(path))
    except (InputError, ValueError) as error:
        raise InputError(f"cannot read the trackers in {path}: {error}") from error
    found = []
    for label, table in tables.items():
        if not isinstance(table, dict) or not isinstance(table.get("tracker"), str):
            raise InputError(f'{path}: expected a table for each tracker, with  tracker = "pso"; found {label!r}')
        options = {name: value for name, value in table.items() if name != "tracker"}
        found.append(TrackerSpec(label, _config(table["tracker"], options)))
    return found


def _value(text: str) -> Any:
    """Return the value of TOML text, or the text itself, so that strings need no quotes."""
    try:
        return parse_toml(f"value = {text}")["value"]
    except ValueError:
        return text


def _config(tracker: str, options: dict[str, Any]) -> TrackerConfig:
    if "seed" in options:
        raise InputError("the option 'seed' is not for trackers of a comparison: use --seed and --repeats")
    return tracker_config(tracker, **options)
