"""Videos with depth: Azure Kinect, FFV1, cut files, and colours in place of depth."""

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.recording import image_size, open_sequence
from depthtrack.recording.reading import ReadingOptions
from tests.geometry.test_registration import DISTORTION, T_COLOUR_DEPTH, seen
from tests.support.lerobot import write_video
from tests.support.matroska import calibration, write_azure_kinect
from tests.support.recordings import CAMERA, depth_at

pytest.importorskip("av", reason="needs the extra: pip install 'depthtrack[video]'")

DEPTH = Camera(640, 576, 504.25, 504.5, 320.3, 331.7)
COLOUR = Camera(1280, 720, 605.1, 604.9, 638.2, 366.4)
TIMES = tuple(0.5 + index / 30 for index in range(4))


@pytest.fixture(scope="module")
def kinect(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a recording of the scene of two cameras; depth has a step per frame."""
    path = tmp_path_factory.mktemp("kinect") / "hand.mkv"
    depth, _ = seen(DEPTH, np.eye(4))
    _, colour = seen(COLOUR, T_COLOUR_DEPTH, DISTORTION)
    depths = [np.rint(depth * 1000).astype(np.uint16) + index for index in range(len(TIMES))]
    described = calibration(DEPTH, COLOUR, T_COLOUR_DEPTH, DISTORTION.coefficients)
    return write_azure_kinect(path, depths, [colour] * len(TIMES), described, TIMES)


def test_depth_and_camera_are_those_of_the_file(kinect: Path) -> None:
    recording = open_sequence(kinect)
    assert len(recording) == len(TIMES)
    np.testing.assert_allclose(recording.timestamps, TIMES, rtol=0, atol=1e-6)
    np.testing.assert_allclose(recording.camera.matrix, DEPTH.matrix, rtol=0, atol=1e-9)
    assert image_size(kinect) == (640, 576)
    expected, _ = seen(DEPTH, np.eye(4))
    for index in (3, 0, 2, 1):
        np.testing.assert_allclose(recording[index].depth, expected + 0.001 * index, rtol=0, atol=0.51e-3)


def test_colour_is_registered_to_the_depth(kinect: Path) -> None:
    recording = open_sequence(kinect)
    _, expected = seen(DEPTH, np.eye(4))
    colour = recording[1].colour
    assert recording.has_colour
    assert colour is not None
    assert any("registered" in note for note in recording.notes)
    edges = cv2.dilate(cv2.Canny(expected[..., 0], 50, 100), np.ones((7, 7), np.uint8)) > 0
    inside = np.asarray(colour.any(axis=-1)) & ~edges
    assert inside.mean() > 0.5
    assert (np.abs(colour.astype(int) - expected).max(axis=-1) < 25)[inside].mean() > 0.995
    alone = open_sequence(kinect, reading=ReadingOptions(depth_only=True))
    assert not alone.has_colour
    assert alone[1].colour is None


def test_a_file_that_is_cut_short_is_read_up_to_the_cut(kinect: Path, tmp_path: Path) -> None:
    data = kinect.read_bytes()
    path = tmp_path / "cut.mkv"
    path.write_bytes(data[: int(0.7 * len(data))])
    recording = open_sequence(path, on_damage="skip")
    assert any("cut short" in note for note in recording.notes)
    assert 2 <= len(list(recording)) <= 3
    assert not any("cut short" in note for note in open_sequence(kinect).notes)


def test_another_video_needs_a_camera(tmp_path: Path) -> None:
    frames = [np.rint(1000 * depth_at(index)).astype(np.uint16) for index in range(5)]
    path = write_video(tmp_path / "film.mkv", frames, "ffv1", "gray16le", options={}, container_format="matroska")
    with pytest.raises(InputError, match="describes no camera"):
        open_sequence(path)
    recording = open_sequence(path, CAMERA)
    for index in (4, 1, 0, 3):
        np.testing.assert_allclose(recording[index].depth, depth_at(index), rtol=0, atol=0.51e-3)


@pytest.mark.parametrize("pixel_format", ["yuv420p", "gray"])
def test_depth_as_colours_is_rejected(tmp_path: Path, pixel_format: str) -> None:
    import av

    path = tmp_path / "film.mkv"
    with av.open(str(path), "w") as file:
        stream: Any = file.add_stream("ffv1", rate=30)
        stream.width, stream.height, stream.pix_fmt = 64, 48, pixel_format
        frame = av.VideoFrame.from_ndarray(np.zeros((48, 64, 3), np.uint8), format="rgb24")
        for packet in [*stream.encode(frame.reformat(format=pixel_format)), *stream.encode(None)]:
            file.mux(packet)
    with pytest.raises(InputError, match="has lost its meaning"):
        open_sequence(path, CAMERA)


@pytest.mark.parametrize(
    ("described", "message"),
    [
        ("{", "malformed"),
        ('{"CalibrationInformation": {"Cameras": []}}', "malformed"),
        ('{"CalibrationInformation": {"Cameras": [{"Location": "CALIBRATION_CameraLocationD0"}]}}', "malformed"),
        ("[" * 100_000, "malformed"),
        (" " * (1 << 21), "at most"),
    ],
)
def test_a_malformed_calibration_is_rejected(tmp_path: Path, described: str, message: str) -> None:
    depths = [np.full((576, 640), 500, np.uint16)]
    path = write_azure_kinect(tmp_path / "film.mkv", depths, [], described, TIMES[:1])
    with pytest.raises(InputError, match=message):
        open_sequence(path)


def test_a_size_that_is_no_mode_of_the_camera_is_rejected(tmp_path: Path) -> None:
    described = calibration(DEPTH, COLOUR, T_COLOUR_DEPTH)
    depths = [np.full((24, 32), 500, np.uint16)]
    path = write_azure_kinect(tmp_path / "film.mkv", depths, [], described, TIMES[:1])
    with pytest.raises(InputError, match="640x576"):
        open_sequence(path)


@pytest.mark.parametrize("content", [b"", b"\x1a\x45\xdf\xa3", b"\x1a\x45\xdf\xa3" + bytes(range(256)) * 8])
def test_other_files_are_rejected(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "film.mkv").write_bytes(content)
    with pytest.raises(InputError):
        open_sequence(tmp_path / "film.mkv", CAMERA)
