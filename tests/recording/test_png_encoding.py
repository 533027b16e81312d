"""Encoded greyscale PNG, read back by OpenCV and Pillow."""

import zlib
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image as Pictures

from depthtrack.recording import png_encoding
from depthtrack.recording.depth_png import decode_depth_png
from depthtrack.recording.png_encoding import encode_png


@given(
    seed=st.integers(0, 2**32 - 1),
    shape=st.tuples(st.integers(1, 80), st.integers(1, 40)),
    dtype=st.sampled_from([np.uint8, np.uint16]),
    smooth=st.booleans(),
)
def test_pixels_read_back_are_equal(seed: int, shape: tuple[int, int], dtype: type, smooth: bool) -> None:
    random = np.random.default_rng(seed)
    image: Any = random.integers(0, np.iinfo(dtype).max, shape, dtype=dtype, endpoint=True)
    if smooth:
        image = np.add.outer(np.arange(shape[0]), np.arange(shape[1])).astype(dtype)
    data = encode_png(image)
    assert data == encode_png(np.asfortranarray(image))
    np.testing.assert_array_equal(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED), image)
    if dtype is np.uint16:
        np.testing.assert_array_equal(decode_depth_png(data), image)


def test_pillow_verifies_the_checksums(tmp_path: Path) -> None:
    path = tmp_path / "depth.png"
    path.write_bytes(encode_png(np.full((5, 4), 700, np.uint16)))
    with Pictures.open(path) as picture:
        picture.verify()


def test_zlib_compresses_the_same_pixels(monkeypatch: pytest.MonkeyPatch) -> None:
    image = np.random.default_rng(0).integers(0, 4000, (48, 64), dtype=np.uint16)
    monkeypatch.setattr(png_encoding, "compress", zlib.compress)
    np.testing.assert_array_equal(decode_depth_png(encode_png(image)), image)


def test_smooth_depth_takes_the_row_above() -> None:
    slope = np.add.outer(37 * np.arange(200), 41 * np.arange(160)).astype(np.uint16)
    assert len(encode_png(slope)) < slope.nbytes / 10
