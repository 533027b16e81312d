"""LZFSE data is decompressed only if its blocks declare the expected size."""

import struct
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.errors import InputError, MissingExtraError
from depthtrack.recording.lzfse import decompress

lzfse = pytest.importorskip("lzfse", reason="needs the extra: pip install 'depthtrack[record3d]'")

RANDOM = np.random.default_rng(1)
SAMPLES = {
    "empty blocks": b"",
    "short": b"abc" * 5,
    "short repeats (LZVN)": b"abcdefgh" * 300,
    "noise": RANDOM.bytes(50_000),
    "plane": np.linspace(0.3, 0.9, 200_000).astype("<f4").tobytes(),
    "constant": bytes(1_228_800),
    "steps": np.repeat(RANDOM.random(300).astype("<f4"), 1000).tobytes(),
}


@pytest.mark.parametrize("name", [name for name in SAMPLES if SAMPLES[name]])
def test_data_returns_as_it_was(name: str) -> None:
    content = SAMPLES[name]
    assert decompress(lzfse.compress(content), len(content)) == content


def test_raw_blocks_written_by_hand_are_read() -> None:
    data = b"bvx-" + struct.pack("<I", 5) + b"hello" + b"bvx-" + struct.pack("<I", 3) + b"abc" + b"bvx$"
    assert decompress(data, 8) == b"helloabc"


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (b"", "is cut"),
        (b"bvx2" + b"\1", "is cut"),
        (b"abcd" + bytes(40), "marked bvx"),
        (b"bvx-" + struct.pack("<I", 1 << 31) + b"x", "is cut"),
        (b"bvxn" + struct.pack("<2I", 1 << 31, 4) + b"abcd" + b"bvx$", "2,147,483,648 declared"),
        (b"bvx2" + struct.pack("<I3Q", 8, 9000 << 40, 0, 32) + b"bvx$", "more matches"),
        (b"bvx1" + struct.pack("<4I", 8, 0, 0, 9000) + bytes(752) + b"bvx$", "more matches"),
        (b"bvx$", "found 0 declared"),
    ],
)
def test_damage_and_other_sizes_are_refused_before_decompression(
    data: bytes, expected: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lzfse, "decompress", None)
    with pytest.raises(InputError, match=expected):
        decompress(data, 8)


@given(cut=st.integers(1, 2000), place=st.integers(0, 2000), value=st.integers(0, 255))
def test_a_cut_is_always_found(cut: int, place: int, value: int) -> None:
    data = lzfse.compress(SAMPLES["steps"][:40_000])
    with pytest.raises(InputError):
        decompress(data[: -min(cut, len(data))], 40_000)


def test_without_the_library_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "lzfse", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'depthtrack\[record3d\]'"):
        decompress(b"bvx$", 0)
