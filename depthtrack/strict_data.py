"""JSON and TOML of files from elsewhere, and JSON that all programs read.

JSON has no NaN and no Infinity. Values read are plain and bounded: whole numbers of 64 bits, text without half
characters, and few levels of nesting, so that no later step meets a foreign exception.
"""

import json
import math
import tomllib
from typing import Any, NoReturn

from depthtrack.errors import is_text
from depthtrack.number_text import parse_number, shown

DEEPEST = 40
"""Levels of nested lists and objects that are read."""
_LARGEST = 2**64
"""Bound on whole numbers, which include seeds."""


def parse_json(text: str | bytes, undefined: bool = False) -> Any:
    """Return the value of strict JSON text.

    undefined: read NaN and Infinity, which other programs write, as None.

    Raises:
        ValueError: if it is none, or its numbers, text or nesting exceed the bounds.
    """
    try:
        constant = _undefined if undefined else _reject_constant
        value = json.loads(text, parse_constant=constant, parse_float=_finite, parse_int=_whole)
    except RecursionError:
        raise ValueError(f"expected at most {DEEPEST} levels of nesting, found more") from None
    check_plain(value)
    return value


def parse_toml(text: str) -> dict[str, Any]:
    """Return the tables of TOML text.

    Raises:
        ValueError: if it is none, or its numbers or nesting exceed the bounds.
    """
    try:
        tables = tomllib.loads(text, parse_float=parse_number)
    except RecursionError:
        raise ValueError(f"expected at most {DEEPEST} levels of nesting, found more") from None
    except tomllib.TOMLDecodeError:
        raise
    except ValueError:  # tomllib passes on Python's limits, such as that on the digits of a whole number
        raise ValueError("expected numbers and dates that fit, found one too large") from None
    check_plain(tables)
    return tables


def check_plain(value: Any) -> None:
    """Check the nesting, the whole numbers and the text of parsed data.

    Raises:
        ValueError: if one exceeds its bound.
    """
    level, depth = [value], 0
    while level:
        following: list[Any] = []
        for each in level:
            if isinstance(each, dict):
                following += each.keys()
                following += each.values()
            elif isinstance(each, list):
                following += each
            elif isinstance(each, str):
                _check_text(each)
            elif isinstance(each, int) and abs(each) >= _LARGEST:
                raise ValueError("expected whole numbers of at most 64 bits, found a larger one")
        level, depth = following, depth + 1
        if depth > DEEPEST:
            raise ValueError(f"expected at most {DEEPEST} levels of nesting, found more")


def json_text(value: Any, indent: int | None = None, ascii_only: bool = True) -> str:
    """Return strict JSON text; a number that is not finite becomes null (undefined)."""
    return json.dumps(_defined(value), indent=indent, allow_nan=False, ensure_ascii=ascii_only)


def exact_json_text(value: Any, indent: int | None = None) -> str:
    """Return strict JSON text.

    Raises:
        ValueError: if a number is not finite.
    """
    return json.dumps(value, indent=indent, allow_nan=False)


def _defined(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _defined(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_defined(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _check_text(text: str) -> None:
    if not is_text(text):
        raise ValueError(f"expected Unicode text, found half a character in {shown(text)}")


def _finite(text: str) -> float:
    value = parse_number(text)
    if not math.isfinite(value):
        raise ValueError(f"expected numbers of 64 bits, found {shown(text)}")
    return value


def _whole(text: str) -> int:
    if len(text) > len(str(_LARGEST)) + 1:
        raise ValueError(f"expected whole numbers of at most 64 bits, found {shown(text)}")
    return int(text)


def _undefined(name: str) -> None:
    return None


def _reject_constant(name: str) -> NoReturn:
    raise ValueError(f"JSON has no {name}")
