"""The compression 16z returns what an encoder written value by value stored."""

import struct
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from depthtrack.recording.depth16z import decompress, decompress_with_table
from tests.support.oni import compress16z, compress16z_with_table

STEPS = arrays(np.int16, st.integers(0, 300), elements=st.sampled_from([0, 0, 0, 1, -6, 6, 7, -63, 64, 900, -2000]))


@given(steps=STEPS, first=st.integers(0, 0x7FFF))
def test_values_return_as_they_were(steps: NDArray[np.int16], first: int) -> None:
    # The high bit of a stated value marks a difference: values have 15 bits.
    values = (np.cumsum([first, *steps]) & 0x7FFF).astype(np.uint16)
    np.testing.assert_array_equal(decompress(compress16z(values), len(values)), values)
    np.testing.assert_array_equal(decompress_with_table(compress16z_with_table(values), len(values)), values)


def test_bytes_written_by_hand_are_decoded() -> None:
    # 1000; falls 1 and -2; three pairs; fall 0, then -40; then the value 0x1234; then fall 6 and nothing.
    data = struct.pack("<H", 1000) + bytes([0x74, 0xE1, 0x6F, 192 - 40, 0xFF, 0x12, 0x34, 0xCD])
    expected = [1000, 999, 1001, 1001, 1001, 1001, 1041, 0x1234, 0x1234 - 6]
    np.testing.assert_array_equal(decompress(data, len(expected)), expected)
    table = struct.pack("<3H", 2, 500, 700) + struct.pack("<H", 1) + bytes([0x7D, 0xE1])
    np.testing.assert_array_equal(decompress_with_table(table, 4), [700, 500, 500, 500])


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (b"", "first value is missing"),
        (b"\0\0\xff", "end is missing"),
        (b"\0\0\xff\x12", "end is missing"),
        (b"\0\0\x6f", "end is missing"),
        (b"\0\0\xe4", "must hold 4 values, found 9"),
        (b"\0\0" + b"\xfe" * 1000, "must hold 4 values, found 60,001"),
    ],
)
def test_damage_is_an_error(data: bytes, expected: str) -> None:
    with pytest.raises(ValueError, match=expected):
        decompress(data, 4)


def test_rows_outside_the_table_are_an_error() -> None:
    with pytest.raises(ValueError, match="outside its table"):
        decompress_with_table(struct.pack("<3H", 2, 500, 700) + struct.pack("<H", 2) + b"\xe1", 3)


@given(data=st.binary(max_size=60), count=st.integers(1, 40))
def test_any_bytes_give_values_or_an_error(data: bytes, count: int) -> None:
    with suppress(ValueError):
        assert len(decompress_with_table(data, count)) == count
