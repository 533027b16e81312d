"""Ranges of numeric options: stated once, shown by the help, and checked before the work."""

import math
from dataclasses import dataclass
from types import UnionType
from typing import Any, Union, get_args, get_origin

from depthtrack.errors import InputError

MOST_SEED = 2**63 - 1

_MOST_BY_UNIT = {
    "s": 3600.0,
    "rad": 7.0,
    "frames": 1_000_000,
    "points": 1_000_000,
    "pixels": 10_000,
    "px": 10_000,
    "of 255": 255.0,
    "m/s^2": 10_000.0,
    "rad/s^2": 100_000.0,
}
"""Upper ends of ranges that an option does not state itself."""
_MOST_COUNT, _MOST = 10_000, 100.0
"""The same of other whole numbers and of other numbers: they bound memory and time."""


@dataclass(frozen=True)
class Range:
    """Numbers from `least` to `most`, both included."""

    least: float
    most: float

    def __str__(self) -> str:
        if math.isinf(self.most):
            return f"at least {_text(self.least)}"
        return f"from {_text(self.least)} to {_text(self.most)}"

    def check(self, value: Any, name: str) -> None:
        """Check a number, or each of several ones; others pass.

        name: of the option, for errors.

        Raises:
            InputError: a number lies outside.
        """
        for number in value if isinstance(value, tuple) else (value,):
            is_number = isinstance(number, int | float) and not isinstance(number, bool)
            if is_number and not self.least <= number <= self.most:
                raise InputError(f"{name} must be {self}, found {_text(number)}")


SEEDS = Range(0, MOST_SEED)


def range_of(kind: Any, unit: str, least: float | None, most: float | None) -> Range | None:
    """Return the range of an option; None if it is no number.

    kind: its type.
    least, most: ends that the option states itself.
    """
    kinds = _numbers_in(kind)
    if not kinds:
        return None
    usual = _MOST_BY_UNIT.get(unit, _MOST if float in kinds else _MOST_COUNT)
    return Range(0 if least is None else least, usual if most is None else most)


def _numbers_in(kind: Any) -> set[type]:
    """Return int and float, if the type holds them."""
    if kind in (int, float):
        return {kind}
    if get_origin(kind) in (Union, UnionType, tuple):
        return set().union(*map(_numbers_in, get_args(kind)))
    return set()


def _text(number: float) -> str:
    text = str(number) if isinstance(number, int) else f"{number:.6g}"
    return text if len(text) <= 40 else f"{text[:37]}..."
