"""Reading and validation of motion files (TOML): those of `sequences/` and a user's own."""

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np

from depthtrack.errors import InputError
from depthtrack.files import read_text
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.pose import ANGLE_NAMES, FINGERS
from depthtrack.resources import resource_folder
from depthtrack.strict_data import parse_toml
from depthtrack.types import Array

POSTURES_FILE = "postures.toml"


def motion_names() -> list[str]:
    """Return the names of the built-in motions."""
    return sorted(path.stem for path in resource_folder("sequences").glob("*.toml") if path.name != POSTURES_FILE)


def find_motion(name: str) -> Path:
    """Return the file of a built-in motion, or the given path of a .toml file.

    Raises: InputError if neither exists.
    """
    if name in motion_names():
        return resource_folder("sequences") / f"{name}.toml"
    path = Path(name)
    if path.suffix == ".toml" and path.is_file():
        return path
    raise InputError(f"no motion '{name}': choose one of {', '.join(motion_names())}, or give the path of a .toml file")


def read_table(path: Path) -> dict[str, Any]:
    """Parse a TOML file.

    Raises: InputError if the file is missing, larger than 1 MiB, or not TOML.
    """
    try:
        return parse_toml(read_text(path))
    except ValueError as error:
        raise InputError(f"cannot read the motion file {path}: {error}") from error


def check_names(entries: Mapping[str, Any], known: Iterable[str], where: str) -> None:
    """Raise InputError if an entry has an unknown name."""
    known = list(known)
    for name in entries:
        if name not in known:
            raise InputError(f"{where}: unknown entry '{name}', use {', '.join(known)}")


def numbers(value: Any, count: int, bound: float, where: str) -> Array:
    """Return `count` numbers (count,) of magnitude at most `bound`.

    Raises: InputError if `value` is anything else.
    """
    valid = isinstance(value, list) and len(value) == count and all(_is_number(v) and abs(v) <= bound for v in value)
    if not valid:
        raise InputError(f"{where} must be {count} numbers between {-bound:g} and {bound:g}, found {_short(value)}")
    return np.array(value, dtype=np.float64)


def number(entries: Mapping[str, Any], name: str, low: float, high: float, where: str) -> float:
    """Return the entry `name` as a number between `low` and `high`.

    Raises: InputError if the entry is missing or anything else.
    """
    value = entries.get(name)
    if not (_is_number(value) and low <= value <= high):
        raise InputError(f"{where}: {name} must be a number from {low:g} to {high:g}, found {_short(value)}")
    return float(value)


def text(entries: Mapping[str, Any], name: str, where: str) -> str:
    """Return the entry `name` as text.

    Raises: InputError if the entry is missing, empty or not text.
    """
    value = entries.get(name)
    if not isinstance(value, str) or not value.strip():
        raise InputError(f"{where}: {name} must be a line of text, found {_short(value)}")
    return value


def table(parent: Mapping[str, Any], name: str, where: str) -> dict[str, Any]:
    """Return the entry `name` as a table.

    Raises: InputError if the entry is missing or not a table.
    """
    value = parent.get(name)
    if not isinstance(value, dict):
        raise InputError(f"{where}: [{name}] must be a table, found {_short(value)}")
    return value


def tables(entries: Mapping[str, Any], name: str, most: int, where: str) -> list[dict[str, Any]]:
    """Return the entry `name` as a list of 1 to `most` tables.

    Raises: InputError if the entry is missing or anything else.
    """
    value = entries.get(name)
    if not isinstance(value, list) or not 1 <= len(value) <= most or not all(isinstance(v, dict) for v in value):
        raise InputError(f"{where}: {name} must be a list of 1 to {most} tables, found {_short(value)}")
    return value


def posture(entries: Mapping[str, Any], where: str) -> dict[str, Array]:
    """Return the angles (4,) in radians of each finger among the entries.

    Raises: InputError if an angle is not a number or outside its joint limits.
    """
    angles = {}
    for finger in FINGERS:
        if finger in entries:
            angles[finger] = np.radians(numbers(entries[finger], 4, 180, f"{where}, {finger} in degrees"))
            _check_limits(finger, angles[finger], where)
    return angles


def shared_postures(motion: Mapping[str, Any], where: str) -> dict[str, Array]:
    """Return the named postures of `postures.toml` and of the motion's own table, if it has one.

    Result (20,) each: finger angles, radians.
    Raises: InputError if a posture lacks a finger or violates a joint limit.
    """
    own = table(motion, "postures", where) if "postures" in motion else {}
    path = resource_folder("sequences") / POSTURES_FILE
    postures = {}
    for source, shapes in ((str(path), read_table(path)), (where, own)):
        for name, fingers in shapes.items():
            place = f"{source}, posture '{name}'"
            if not isinstance(fingers, dict) or set(fingers) != set(FINGERS):
                raise InputError(f"{place} must give {', '.join(FINGERS)} and nothing else, found {_short(fingers)}")
            postures[name] = np.concatenate([posture(fingers, place)[finger] for finger in FINGERS])
    return postures


def elbow(entries: Mapping[str, Any], where: str) -> Array:
    """Return the elbow position (3,), metres, scene frame.

    The default is that of a person who faces the camera.

    Raises: InputError if the entry is not three numbers.
    """
    return numbers(entries.get("elbow", [-50, 260, 110]), 3, 2000, f"{where}: elbow in mm") / 1000


def _check_limits(finger: str, angles: Array, where: str) -> None:
    first = 4 * FINGERS.index(finger)
    low, high = LOWER[first : first + 4], UPPER[first : first + 4]
    for k in np.flatnonzero((angles < low - 1e-9) | (angles > high + 1e-9)):
        found, least, most = (round(math.degrees(value)) for value in (angles[k], low[k], high[k]))
        raise InputError(
            f"{where}: {ANGLE_NAMES[first + k]} must lie within its range, {least} to {most} degrees, found {found}"
        )


def _is_number(value: object) -> TypeGuard[float]:
    # A comparison, unlike isfinite, accepts integers that are too large for a float.
    return isinstance(value, int | float) and not isinstance(value, bool) and -math.inf < value < math.inf


def _short(value: object) -> str:
    shown = repr(value)
    return shown if len(shown) <= 60 else f"{shown[:57]}..."
