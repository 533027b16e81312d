"""RVL data against a slow encoder and words worked out by hand."""

import struct
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from depthtrack.errors import InputError
from depthtrack.recording.rvl import decompress
from tests.support.bags import compress_rvl


def test_words_by_hand() -> None:
    """Two zeros, three others: 1000 for +500, 1 for -1, 4 for +2; one zero, no others."""
    nibbles = "23" + "8df1" + "1" + "4" + "10"
    words = [int(nibbles[i : i + 8].ljust(8, "0"), 16) for i in range(0, len(nibbles), 8)]
    data = struct.pack(f"<{len(words)}I", *words)
    np.testing.assert_array_equal(decompress(data, 6), [0, 0, 500, 499, 501, 0])
    assert compress_rvl([0, 0, 500, 499, 501, 0]) == data


@given(arrays(np.uint16, st.integers(1, 60), elements=st.sampled_from([0, 0, 1, 2, 700, 701, 65535])))
def test_the_encoder_is_inverted(values: np.ndarray) -> None:
    data = compress_rvl(values)
    np.testing.assert_array_equal(decompress(data, len(values)), values)
    np.testing.assert_array_equal(decompress(data + bytes(9), len(values)), values)


@given(st.binary(max_size=200), st.integers(1, 500))
def test_any_data_gives_an_image_or_an_error(data: bytes, pixels: int) -> None:
    with suppress(InputError):
        assert decompress(data, pixels).shape == (pixels,)


@pytest.mark.parametrize(
    "data", [b"", b"\xff" * 40, compress_rvl([0, 5, 6] * 30)[:12], compress_rvl([7] * 200)], ids=str
)
def test_damaged_data_is_refused(data: bytes) -> None:
    with pytest.raises(InputError, match="RVL data"):
        decompress(data, 90)


def test_the_largest_image_of_the_longest_numbers_is_read() -> None:
    values = np.tile(np.array([1, 65535, 1, 65535], np.uint16), 500)
    np.testing.assert_array_equal(decompress(compress_rvl(values), len(values)), values)
