"""Containers are read as rosbags writes them, compressed and cut short, within bounds."""

from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.recording import open_sequence
from depthtrack.recording.bags import chunks
from depthtrack.recording.bags.opening import open_storage
from tests.support.bags import compose
from tests.support.recordings import CAMERA, colour_at, depth_at

TIMES = tuple(1_700_000_000 + index / 30 for index in range(40))
KINDS = pytest.mark.parametrize("suffix", [".bag", ".db3", ".mcap"])


def big_depth(index: int) -> np.ndarray:
    """Return depth that hardly compresses, so that a file has many chunks or pages."""
    noise = np.random.default_rng(index).uniform(0, 0.1, (240, 320))
    return (0.5 + noise).astype(np.float32)


BIG = CAMERA.resized(10)


def write_big(path: Path, compress: bool = False) -> Path:
    return compose(big_depth, None, BIG, TIMES).write(path, compress)


@KINDS
@pytest.mark.parametrize("compress", [False, True])
def test_depth_and_colour_are_those_that_were_written(tmp_path: Path, suffix: str, compress: bool) -> None:
    path = compose(depth_at, colour_at, CAMERA, TIMES[:5]).write(tmp_path / f"film{suffix}", compress)
    sequence = open_sequence(path)
    assert (len(sequence), sequence.camera, sequence.notes) == (5, CAMERA, [])
    np.testing.assert_allclose(sequence.timestamps, TIMES[:5], rtol=0, atol=1e-6)
    for index in (4, 0, 2, 1, 3):
        np.testing.assert_allclose(sequence[index].depth, depth_at(index), rtol=0, atol=0.51e-3)
        np.testing.assert_array_equal(sequence[index].colour, colour_at(index))


@KINDS
@pytest.mark.parametrize("share", [0.35, 0.8])
def test_a_file_that_is_cut_short_is_read_up_to_the_cut(tmp_path: Path, suffix: str, share: float) -> None:
    path = write_big(tmp_path / f"film{suffix}")
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    sequence = open_sequence(path, on_damage="skip")
    frames = list(sequence)
    assert share * len(TIMES) - 9 < len(frames) <= share * len(TIMES) + 1
    assert any("cut short" in note or "damaged" in note for note in sequence.notes)
    for frame in frames:
        np.testing.assert_allclose(frame.depth, big_depth(frame.index), rtol=0, atol=0.51e-3)


@KINDS
def test_a_file_without_any_image_is_rejected(tmp_path: Path, suffix: str) -> None:
    path = write_big(tmp_path / f"film{suffix}")
    path.write_bytes(path.read_bytes()[:20_000])
    with pytest.raises(InputError, match="film"):
        open_sequence(path)


@KINDS
def test_changed_bytes_damage_single_frames_at_most(tmp_path: Path, suffix: str) -> None:
    path = write_big(tmp_path / f"film{suffix}", compress=True)
    data = bytearray(path.read_bytes())
    generator = np.random.default_rng(0)
    for place in generator.integers(len(data) // 4, len(data), 30):
        data[place] ^= 0x55
    path.write_bytes(bytes(data))
    with suppress(InputError):  # other exceptions are tracebacks
        assert len(list(open_sequence(path, on_damage="skip"))) <= len(TIMES)


def test_a_folder_of_parts_is_one_recording(tmp_path: Path) -> None:
    folder = tmp_path / "ride"
    folder.mkdir()
    for part in range(11):
        times = TIMES[3 * part : 3 * part + 3]

        def depth(index: int, first: int = 3 * part) -> np.ndarray:
            return depth_at(first + index)

        compose(depth, None, CAMERA, times).write(folder / f"ride_{part}.mcap")
    sequence = open_sequence(folder)
    assert len(sequence) == 33
    for index in (32, 5, 30):
        np.testing.assert_allclose(sequence[index].depth, depth_at(index), rtol=0, atol=0.51e-3)


def test_parts_that_are_compressed_as_a_whole_are_rejected_with_the_command(tmp_path: Path) -> None:
    folder = tmp_path / "ride"
    folder.mkdir()
    (folder / "ride_0.db3.zstd").write_bytes(b"\x28\xb5\x2f\xfd" + bytes(40))
    with pytest.raises(InputError, match=r"zstd -d ride_0\.db3\.zstd"):
        open_sequence(folder)


@pytest.mark.parametrize("compression", ["lz4", "zstd", "bz2"])
def test_no_more_than_the_declared_size_is_decompressed(compression: str) -> None:
    import bz2

    import lz4.frame

    zeros = bytes(50_000_000)
    compress: dict[str, Any] = {"lz4": lz4.frame.compress, "zstd": chunks.zstd().compress, "bz2": bz2.compress}
    packed = compress[compression](zeros)
    with pytest.raises(DamagedFrameError, match="found 1,001 or more"):
        chunks.decompress(packed, compression, 1000, "film")
    with pytest.raises(DamagedFrameError, match="at most"):
        chunks.decompress(packed, compression, 1 << 40, "film")
    with pytest.raises(DamagedFrameError, match="cannot be decompressed"):
        chunks.decompress(b"\0" * 100, compression, 1000, "film")


def test_an_unknown_compression_is_rejected() -> None:
    with pytest.raises(DamagedFrameError, match="lz4, zstd or bz2"):
        chunks.decompress(b"", "brotli", 4, "film")


def test_memory_does_not_grow_with_the_length(tmp_path: Path) -> None:
    storage = open_storage(write_big(tmp_path / "film.mcap"))
    for index in range(len(TIMES)):
        storage.read("/camera/depth/image_raw", index)
    assert len(storage._source._kept) <= 3  # type: ignore[attr-defined]
