"""Recordings of Record3D: depth, colour, camera and times; cut and damaged files."""

import json
import zipfile
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

import depthtrack
from depthtrack.cli import main
from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.recording import image_size, open_sequence
from tests.support.record3d import copy_as_r3d, metadata, write_r3d
from tests.support.recordings import CAMERA, TIMES, colour_at, depth_at
from tests.support.runs import synthesise

pytest.importorskip("lzfse", reason="needs the extra: pip install 'depthtrack[record3d]'")


def jpeg(colour: NDArray[np.uint8]) -> bytes:
    return bytes(cv2.imencode(".jpg", colour[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 100])[1].tobytes())


def sample(path: Path, **fields: Any) -> Path:
    depths = [depth_at(k) for k in range(len(TIMES))]
    return write_r3d(path, metadata(CAMERA, TIMES, **fields), depths, [jpeg(colour_at(k)) for k in range(len(TIMES))])


def test_poses_are_those_of_the_folder_that_it_was_copied_from(tmp_path: Path) -> None:
    folder = synthesise(tmp_path / "folder", 3)
    file = copy_as_r3d(folder, tmp_path / "copy.r3d")
    runs = [list(depthtrack.track(open_sequence(path), "average", tracker="ik")) for path in (folder, file)]
    expected, found = (np.array([each.estimate.pose for each in run]) for run in runs)
    assert np.isfinite(expected).all()
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_depth_colour_camera_and_times_are_those_written(tmp_path: Path) -> None:
    path = sample(tmp_path / "a.r3d")
    recording = open_sequence(path)
    assert len(recording) == 5
    assert image_size(path) == (32, 24)
    np.testing.assert_allclose(recording.timestamps, TIMES)
    camera = recording.camera
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy)
    for index in (3, 0, 4):
        frame = recording[index]
        np.testing.assert_array_equal(frame.depth, depth_at(index))
        assert frame.colour is not None
        assert np.abs(frame.colour.astype(int) - colour_at(index)).mean() < 3


def test_larger_colour_is_reduced_to_the_pixels_of_the_depth(tmp_path: Path) -> None:
    large = np.repeat(np.repeat(colour_at(0), 3, axis=0), 3, axis=1)
    fields = metadata(CAMERA, [0], w=96, h=72, K=[90, 0, 0, 0, 91.5, 0, 46, 34, 1])
    path = write_r3d(tmp_path / "a.r3d", fields, [depth_at(0)], [jpeg(large)])
    recording = open_sequence(path)
    camera, colour = recording.camera, recording[0].colour
    assert (camera.width, camera.height) == (32, 24)
    np.testing.assert_allclose((camera.fx, camera.fy), (30, 30.5))
    np.testing.assert_allclose((camera.cx, camera.cy), (15, 11))  # 46.5 / 3 - 0.5
    assert colour is not None
    assert np.abs(colour.astype(int) - colour_at(0)).mean() < 4


def test_readings_that_are_not_finite_are_none(tmp_path: Path) -> None:
    depth = depth_at(0)
    depth[10, :4] = (np.nan, np.inf, -1, 0.25)
    recording = open_sequence(write_r3d(tmp_path / "a.r3d", metadata(CAMERA, [0]), [depth]))
    np.testing.assert_array_equal(recording[0].depth[10, :4], [0, 0, 0, 0.25])
    assert not recording.has_colour


def test_a_changing_focus_gives_the_median_and_a_note(tmp_path: Path) -> None:
    coefficients = [
        [30.0, 30.5, 15, 11],
        [31.0, 31.5, 15, 11],
        [33.0, 33.5, 15, 11],
        [31, 31, 15, 11],
        [31, 31, 15, 11],
    ]
    recording = open_sequence(sample(tmp_path / "a.r3d", perFrameIntrinsicCoeffs=coefficients))
    assert recording.camera.fx == 31.0
    assert any("focal length changes by 9.7 %" in note for note in recording.notes)


def test_times_that_do_not_increase_are_replaced_by_the_rate(tmp_path: Path) -> None:
    recording = open_sequence(sample(tmp_path / "a.r3d", frameTimestamps=[0, 0, 1, 2, 3]))
    np.testing.assert_allclose(recording.timestamps, np.arange(5) / 30)
    assert any("times do not increase" in note for note in recording.notes)


def test_a_cut_file_plays_to_the_cut_and_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = sample(tmp_path / "a.r3d")
    data = path.read_bytes()
    path.write_bytes(data[: data.index(b"rgbd/3.depth") + 40])
    recording = open_sequence(path)
    assert [frame.index for frame in recording] == [0, 1, 2]
    assert main(["info", str(path)]) == 0
    assert "cut short" in capsys.readouterr().out
    path.write_bytes(data[: data.index(b"rgbd/0.jpg") - 40])
    assert main(["info", str(path)]) == 2


def test_a_damaged_frame_costs_that_frame(tmp_path: Path) -> None:
    path = sample(tmp_path / "a.r3d")
    data = bytearray(path.read_bytes())
    data[data.index(b"rgbd/2.depth") + 100] ^= 255
    path.write_bytes(data)
    with pytest.raises(DamagedFrameError, match=r"rgbd/2\.depth"):
        open_sequence(path)[2]
    assert [frame.index for frame in open_sequence(path, on_damage="skip")] == [0, 1, 3, 4]


def test_depth_of_another_size_is_refused(tmp_path: Path) -> None:
    path = sample(tmp_path / "a.r3d", dw=640, dh=480, w=640, h=480)
    with pytest.raises(DamagedFrameError, match="must hold 1,228,800 bytes, found 3,072 declared"):
        open_sequence(path)[0]
    with pytest.raises(DamagedFrameError, match="but the camera has 32x24"):
        open_sequence(path, CAMERA)[0]


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"K": None}, "give the camera"),
        ({"K": ["a"] * 9}, "give the camera"),
        ({"w": 10**9}, "must state w"),
        ({"dh": -3}, "must state dh"),
        ({"fps": "x", "frameTimestamps": []}, "must state fps"),
    ],
)
def test_malformed_metadata_is_one_sentence(fields: dict[str, Any], expected: str, tmp_path: Path) -> None:
    path = sample(tmp_path / "a.r3d", **fields)
    with pytest.raises(InputError, match=expected):
        open_sequence(path)


@pytest.mark.parametrize("text", ["", "[]", "[" * 100_000, "{"])
def test_metadata_that_are_no_object_are_refused(text: str, tmp_path: Path) -> None:
    path = tmp_path / "a.r3d"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("metadata", text)
        archive.writestr("rgbd/0.depth", b"")
    with pytest.raises(InputError, match="JSON"):
        open_sequence(path)


def test_sizes_of_old_files_follow_from_the_colour(tmp_path: Path) -> None:
    for width, height, size in ((480, 640, (480, 640)), (640, 480, (640, 480)), (720, 960, (192, 256))):
        fields = metadata(CAMERA, [0], w=width, h=height)
        del fields["dw"], fields["dh"]
        path = tmp_path / f"{width}.r3d"
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("metadata", json.dumps(fields))
            archive.writestr("rgbd/0.depth", b"")
        assert image_size(path) == size
