"""Range checks of numeric options, because run configurations are untrusted files."""

import dataclasses
import math
from collections.abc import Collection, Mapping
from typing import Any

from depthtrack.errors import InputError

SMALLEST_POSITIVE = 1e-4
"""Lower bound of options that a computation divides by or advances by."""

LARGEST = 100
"""Upper bound of options without their own: it bounds memory and time."""


def check_numbers(group: Any, positive: Collection[str] = (), at_most: Mapping[str, float] | None = None) -> None:
    """Check that the numbers of a group of options are finite and within their bounds.

    positive: options that must not be 0.
    at_most: upper bounds by option.

    Raises:
        InputError: a number is out of range.
    """
    for field in dataclasses.fields(group):
        value = getattr(group, field.name)
        low = SMALLEST_POSITIVE if field.name in positive else 0.0
        high = (at_most or {}).get(field.name, LARGEST)
        if isinstance(value, int | float) and not (math.isfinite(value) and low <= value <= high):
            raise InputError(f"{field.name} must be from {low:g} to {high:g}, found {value:g}")
