"""Colour that is not registered to the depth is found by comparing edges, and left out."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from depthtrack.cli import main
from depthtrack.cli.recording_options import RecordingOptions
from depthtrack.geometry.camera import Camera
from depthtrack.recording import SequenceWriter, open_sequence
from depthtrack.recording.colour_registration import ColourShift, measure_shift

CAMERA = Camera(160, 120, 150.0, 150.0, 79.5, 59.5)


def write_scene(folder: Path, shift: tuple[int, int] = (0, 0), wall: bool = True, noise: float = 0.0) -> Path:
    """Write discs before a wall or nothing; their colour is moved by (right, down)."""
    generator = np.random.default_rng(5)
    with SequenceWriter(folder, CAMERA) as out:
        for index in range(8):
            depth = np.full(CAMERA.shape, 1.5 if wall else 0.0, np.float32)
            colour = np.full((*CAMERA.shape, 3), (90, 110, 80), np.uint8)
            for number in range(5):
                place = tuple(int(x) for x in generator.integers((20, 20), (140, 100)))
                cv2.circle(depth, place, 10, 0.5 + 0.1 * number, -1)
                cv2.circle(colour, place, 10, [int(x) for x in generator.integers(0, 256, 3)], -1)
            colour = np.clip(colour + generator.normal(0, noise, colour.shape), 0, 255).astype(np.uint8)
            out.append(index / 30, depth, colour=np.roll(colour, shift[::-1], axis=(0, 1)))
    return folder


def shift_of(path: Path) -> ColourShift:
    shift = measure_shift(open_sequence(path))
    assert shift is not None
    return shift


@pytest.mark.parametrize("wall", [True, False])
@pytest.mark.parametrize("noise", [0.0, 10.0])
def test_registered_colour_is_kept(tmp_path: Path, wall: bool, noise: float) -> None:
    assert not shift_of(write_scene(tmp_path / "made", wall=wall, noise=noise)).is_sure


@pytest.mark.parametrize("shift", [(5, 0), (0, 7), (-12, 9), (15, 0)])
@pytest.mark.parametrize("wall", [True, False])
def test_shifted_colour_is_found_with_its_shift(tmp_path: Path, shift: tuple[int, int], wall: bool) -> None:
    found = shift_of(write_scene(tmp_path / "made", shift, wall, noise=4.0))
    assert found.is_sure
    np.testing.assert_allclose(found.pixels, shift, atol=1)


def test_recordings_without_edges_or_colour_have_no_shift(tmp_path: Path) -> None:
    with SequenceWriter(tmp_path / "plain", CAMERA) as out:
        out.append(0.0, np.full(CAMERA.shape, 0.5), colour=np.zeros((*CAMERA.shape, 3), np.uint8))
    assert measure_shift(open_sequence(tmp_path / "plain")) is None
    made = write_scene(tmp_path / "made")
    (made / "rgb.txt").unlink()
    assert measure_shift(open_sequence(made)) is None


def test_commands_that_track_use_depth_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made = write_scene(tmp_path / "made", (9, 0))
    assert not RecordingOptions(made).open(tracked=True).has_colour
    assert "not registered" in capsys.readouterr().err
    assert RecordingOptions(made).open().has_colour
    assert main(["info", str(made), "--json"]) == 0
    assert any("+9 pixels across" in note for note in json.loads(capsys.readouterr().out)["notes"])
    registered = write_scene(tmp_path / "registered")
    assert RecordingOptions(registered).open(tracked=True).has_colour


def test_real_colour_is_registered(real_data: Path) -> None:
    for name in ("open-close", "with-ball"):
        assert not shift_of(real_data / "rgbd" / name).is_sure
