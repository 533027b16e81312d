"""Recordings of OpenNI: depth, camera and times; cut and damaged files."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from depthtrack.cli import main
from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.recording import image_size, open_sequence
from tests.support.oni import CODECS, write_oni
from tests.support.recordings import CAMERA, depth_at

FRAMES = 4
DEPTHS = [np.rint(1000 * depth_at(k)).astype(np.uint16) for k in range(FRAMES)]


@pytest.mark.parametrize("codec", CODECS)
@pytest.mark.parametrize("version", [(1, 0, 1), (1, 0, 0)])
def test_depth_times_and_camera(codec: bytes, version: tuple[int, int, int], tmp_path: Path) -> None:
    path = write_oni(tmp_path / "a.oni", DEPTHS, codec=codec, version=version)
    recording = open_sequence(path)
    assert image_size(path) == (32, 24)
    np.testing.assert_allclose(recording.timestamps, np.arange(FRAMES) / 30, atol=1e-5)
    camera = recording.camera
    np.testing.assert_allclose(2 * np.arctan(16 / camera.fx), 1.0)
    np.testing.assert_allclose(2 * np.arctan(12 / camera.fy), 0.8)
    assert (camera.cx, camera.cy) == (15.5, 11.5)
    for index in (2, 0, 3):
        np.testing.assert_allclose(recording[index].depth, DEPTHS[index] / 1000, atol=1e-6)
    assert recording[0].colour is None
    assert not any("cut" in note for note in recording.notes)


def test_the_unit_is_that_of_the_pixel_format(tmp_path: Path) -> None:
    path = write_oni(tmp_path / "a.oni", DEPTHS, pixel_format=101)
    np.testing.assert_allclose(open_sequence(path)[1].depth, DEPTHS[1] / 10_000, atol=1e-7)


def test_without_a_field_of_view_the_camera_is_needed(tmp_path: Path) -> None:
    path = write_oni(tmp_path / "a.oni", DEPTHS, field_of_view=None)
    with pytest.raises(InputError, match="give the camera"):
        open_sequence(path)
    assert len(open_sequence(path, CAMERA)) == FRAMES
    with pytest.raises(DamagedFrameError, match="33x24 pixels, found 32x24"):
        open_sequence(path, replace(CAMERA, width=33))[0]


def test_a_cut_file_plays_to_the_cut_and_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write_oni(tmp_path / "a.oni", DEPTHS)
    data = path.read_bytes()
    path.write_bytes(data[: data.rindex(b"a picture") + 60])
    assert [frame.index for frame in open_sequence(path)] == [0, 1, 2]
    assert main(["info", str(path)]) == 0
    assert "cut short: the 3 frames" in capsys.readouterr().out
    for end in (10, 30, 200):
        path.write_bytes(data[:end])
        with pytest.raises(InputError, match=r"a\.oni"):
            open_sequence(path)


def test_frames_whose_time_does_not_increase_are_left_out(tmp_path: Path) -> None:
    path = write_oni(tmp_path / "a.oni", DEPTHS, times=[0, 40_000, 40_000, 80_000])
    recording = open_sequence(path)
    np.testing.assert_allclose(recording.timestamps, [0, 0.04, 0.08])
    np.testing.assert_allclose(recording[2].depth, DEPTHS[3] / 1000, atol=1e-6)
    assert any("1 frames whose time" in note for note in recording.notes)


def test_a_damaged_frame_costs_that_frame(tmp_path: Path) -> None:
    frames = [CODECS[b"16zT"](depth) for depth in DEPTHS]
    frames[1] = frames[1][:-3]
    frames[2] = bytes(500_000)
    path = write_oni(tmp_path / "a.oni", DEPTHS, frames=frames)
    with pytest.raises(DamagedFrameError, match="frame 1 is damaged"):
        open_sequence(path)[1]
    with pytest.raises(DamagedFrameError, match="must be smaller"):
        open_sequence(path)[2]
    assert [frame.index for frame in open_sequence(path, on_damage="skip")] == [0, 3]


def test_another_compression_or_no_depth_is_refused(tmp_path: Path) -> None:
    path = write_oni(tmp_path / "a.oni", DEPTHS)
    data = path.read_bytes()
    path.write_bytes(data.replace(b"16zT", b"JPEG"))
    with pytest.raises(InputError, match="without compression or as 16z"):
        open_sequence(path)
    path.write_bytes(data.replace(b"Depth\0\2", b"Depth\0\4"))
    with pytest.raises(InputError, match="no depth node"):
        open_sequence(path)
