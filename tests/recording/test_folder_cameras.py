"""Cameras of folders: files of other tools, lens distortion, mirrored images."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from depthtrack.cli import main
from depthtrack.geometry.camera import Camera
from depthtrack.recording import SequenceWriter, open_sequence
from depthtrack.recording.reading import ReadingOptions
from tests.support.folders import stripped_sample
from tests.support.recordings import CAMERA, colour_at, depth_at

WIDE = Camera(160, 120, 100.0, 100.0, 79.5, 59.5)
K1 = -0.2


@pytest.fixture
def distorted(tmp_path: Path) -> Path:
    """A plane at 0.5 m with a bright line at x = 0.3 m, seen through a lens with k1."""
    u, v = np.meshgrid(np.arange(WIDE.width), np.arange(WIDE.height))
    points = np.stack([u, v], axis=-1).astype(np.float64).reshape(-1, 1, 2)
    rays = cv2.undistortPoints(points, WIDE.matrix, np.array([K1, 0.0, 0.0, 0.0])).reshape(*WIDE.shape, 2)
    colour = np.zeros((*WIDE.shape, 3), np.uint8)
    colour[np.abs(0.5 * rays[..., 0] - 0.3) < 0.006] = 255
    with SequenceWriter(tmp_path / "lens", WIDE, colour_format="png") as out:
        out.append(0.0, np.full(WIDE.shape, 0.5), colour=colour)
        out.append(0.1, np.full(WIDE.shape, 0.5), colour=colour)
    return tmp_path / "lens"


def line_of(path: Path, reading: ReadingOptions | None = None) -> np.ndarray:
    """Return the x (m) of the line in each row that shows it."""
    frame = open_sequence(path, reading=reading)[0]
    assert frame.colour is not None
    rows, columns = np.nonzero(frame.colour[..., 0] > 128)
    x = [(columns[rows == row].mean() - WIDE.cx) / WIDE.fx * 0.5 for row in np.unique(rows)]
    return np.array(x)


def test_distortion_of_the_camera_file_is_removed_and_reported(
    distorted: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert np.ptp(line_of(distorted)) > 0.02  # a curve
    (distorted / "camera.json").write_text(json.dumps({**json.loads(WIDE.to_json()), "k1": K1}))
    straight = line_of(distorted)
    assert np.ptp(straight) < 0.008
    assert np.abs(straight - 0.3).max() < 0.006
    assert main(["info", str(distorted)]) == 0
    assert "lens distortion is removed" in capsys.readouterr().out


def test_distortion_by_an_option_is_that_of_the_file(distorted: Path) -> None:
    by_option = line_of(distorted, ReadingOptions(distortion=(K1,)))
    np.testing.assert_allclose(by_option, 0.3, atol=0.006)


def test_an_opened_recording_states_its_distortion_for_a_repetition(distorted: Path) -> None:
    (distorted / "camera.json").write_text(json.dumps({**json.loads(WIDE.to_json()), "k1": K1}))
    first = open_sequence(distorted)
    assert any(first.reading.distortion)  # type: ignore[attr-defined]
    again = open_sequence(distorted, first.camera, reading=first.reading)  # type: ignore[attr-defined]
    np.testing.assert_array_equal(again[0].depth, first[0].depth)


def test_a_camera_file_of_ros_lies_in_the_folder(tmp_path: Path) -> None:
    pytest.importorskip("yaml", reason="the extra 'yaml' is not installed")
    folder = stripped_sample(tmp_path / "sample")
    (folder / "camera.json").unlink()
    matrix = [CAMERA.fx, 0, CAMERA.cx, 0, CAMERA.fy, CAMERA.cy, 0, 0, 1]
    (folder / "camera_info.yaml").write_text(f"width: {CAMERA.width}\nheight: {CAMERA.height}\nk: {matrix}\n")
    sequence = open_sequence(folder)
    assert sequence.camera == CAMERA
    assert any("1 mm" in note for note in sequence.notes)


def test_mirrored_images_are_mirrored_back(tmp_path: Path) -> None:
    folder = stripped_sample(tmp_path / "sample")
    frame = open_sequence(folder, reading=ReadingOptions(mirror=True))[1]
    np.testing.assert_allclose(frame.depth, depth_at(1)[:, ::-1], atol=0.001)
    assert frame.colour is not None
    assert np.abs(frame.colour.astype(int) - colour_at(1)[:, ::-1]).mean() < 3
    assert frame.camera == CAMERA
