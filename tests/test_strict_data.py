"""JSON and TOML from elsewhere are plain and bounded, and ours is strict."""

import ast
import json
import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.strict_data import DEEPEST, exact_json_text, json_text, parse_json, parse_toml

PACKAGE = Path(__file__).parents[1] / "depthtrack"
LIBRARIES = ("json", "tomllib", "pickle", "marshal", "shelve")

_PLAIN = st.none() | st.booleans() | st.integers(-(2**64) + 1, 2**64 - 1) | st.floats() | st.text()
_VALUES = st.recursive(_PLAIN, lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner), max_leaves=20)


def defined(value: Any) -> Any:
    """Return the value with null for numbers that are not finite."""
    if isinstance(value, dict):
        return {key: defined(part) for key, part in value.items()}
    if isinstance(value, list):
        return [defined(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


@given(_VALUES)
def test_json_reads_back_with_null_for_what_is_undefined(value: Any) -> None:
    assert parse_json(json_text(value)) == defined(value)
    if defined(value) == value:
        assert parse_json(exact_json_text(value)) == value
    else:
        with pytest.raises(ValueError, match="not JSON compliant"):
            exact_json_text(value)


@given(_VALUES)
def test_the_text_is_strict_json(value: Any) -> None:
    def reject(name: str) -> None:
        raise AssertionError(name)

    json.loads(json_text(value), parse_constant=reject)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("NaN", "JSON has no NaN"),
        ("[-Infinity]", "JSON has no -Infinity"),
        ("1e999", "expected numbers of 64 bits"),
        ("1" * 30, "whole numbers of at most 64 bits"),
        ("-" + "1" * 5000, "whole numbers of at most 64 bits"),
        (str(2**64), "whole numbers of at most 64 bits"),
        ("0." + "1" * 8000, "expected a number, found"),
        ("[" * 41 + "]" * 41, f"at most {DEEPEST} levels"),
        ("[" * 100_000, f"at most {DEEPEST} levels"),
        ('{"a":' * 900 + "1" + "}" * 900, f"at most {DEEPEST} levels"),
        (r'"\ud800"', "half a character"),
        (r'{"\udfff": 1}', "half a character"),
        ("", "Expecting value"),
        ("\x00", "Expecting value"),
        (b"\xff\xfe", "."),
    ],
)
def test_other_json_is_rejected(text: str | bytes, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        parse_json(text)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x = " + "9" * 5000, "fit"),
        ("x = " + "9" * 300, "whole numbers of at most 64 bits"),
        ("x = 0x" + "f" * 5000, "whole numbers of at most 64 bits"),
        ("x = " + "[" * 5000, f"at most {DEEPEST} levels"),
        ("x = " + "[" * 60 + "]" * 60, f"at most {DEEPEST} levels"),
        (".".join("a" * 200) + " = 1", f"at most {DEEPEST} levels"),
        ("x = 1." + "1" * 8000, "fit"),
        ("x = 9999-99-99", "."),
    ],
)
def test_other_toml_is_rejected(text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        parse_toml(text)


def test_one_module_reads_and_writes_json_and_toml() -> None:
    found = set()
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            if {name.partition(".")[0] for name in names} & set(LIBRARIES):
                found.add(str(path.relative_to(PACKAGE)))
    assert found == {"strict_data.py"}


def test_undefined_numbers_of_other_programs_are_none() -> None:
    assert parse_json('[NaN, -Infinity, {"a": Infinity}, 1]', undefined=True) == [None, None, {"a": None}, 1]
