"""Numbers in text: Python's numbers, within bounds."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.number_text import (
    LONGEST,
    parse_number,
    parse_number_or_blank,
    parse_numbers,
    parse_numbers_or_blanks,
    parse_whole_number,
)

BAD = (
    "",
    " ",
    "x",
    "1_0",
    "1__0",
    "٣",
    "１",
    "0x10",
    "1,5",
    "1e",
    "--1",
    "1 2",
    "nan(1)",
    "1" * (LONGEST + 1),
    "\x00",
    "1\x00",
)


@given(st.floats())
def test_the_text_of_a_number_is_read_back(value: float) -> None:
    for text in (repr(value), f" {value!r}\t", f"{value:.40e}"):
        assert math.isnan(value) == math.isnan(parse_number(text))
        assert math.isnan(value) or parse_number(text) == value


@pytest.mark.parametrize("text", BAD)
def test_other_text_is_rejected(text: str) -> None:
    with pytest.raises(ValueError, match="expected a number, found"):
        parse_number(text)
    with pytest.raises(ValueError, match="expected a number, found"):
        parse_numbers(["1", text, "2"])


@given(st.lists(st.floats(allow_nan=False) | st.none()))
def test_blank_cells_are_unknown(values: list[float | None]) -> None:
    texts = ["" if value is None else repr(value) for value in values]
    found = parse_numbers_or_blanks(texts)
    assert [None if math.isnan(value) else value for value in found] == values
    assert [math.isnan(parse_number_or_blank(text)) for text in texts] == [value is None for value in values]


@given(st.integers(-(10**18) + 1, 10**18 - 1))
def test_whole_numbers_are_read_back(value: int) -> None:
    assert parse_whole_number(f" {value}\n") == value


@pytest.mark.parametrize("text", [*BAD, "1.0", "1e3", "-", "+1", "1" * 19, "nan"])
def test_other_text_is_no_whole_number(text: str) -> None:
    with pytest.raises(ValueError, match="expected a whole number, found"):
        parse_whole_number(text)
