"""Depth that cannot be right: values without meaning, units, disparity, pictures of depth."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

import depthtrack as dt
from depthtrack.cli import main
from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.recording import SequenceWriter, open_sequence
from depthtrack.recording.depth_checks import check_depth, depth_notes, no_hand_note, poor_agreement_note
from depthtrack.recording.depth_histogram import STORED_VALUES, sampled_histogram
from depthtrack.recording.reading import ReadingOptions

Stored = NDArray[np.uint16]
CAMERA = Camera(64, 48, 60.0, 60.0, 31.5, 23.5, 0.001)


def scene(wall: bool = True) -> Stored:
    """A hand-sized patch at 0.45 m, before a noisy wall at 2 m or nothing; a corner is missing."""
    noise = np.random.default_rng(0).normal(0, 15, CAMERA.shape)
    depth = np.rint(2000 + noise) if wall else np.zeros(CAMERA.shape)
    depth[15:35, 20:44] = 450 + np.arange(24)
    depth[:6, :9] = 0
    return depth.astype(np.uint16)


def notes(stored: Stored, scale: float = 0.001) -> list[str]:
    return depth_notes(np.bincount(stored.ravel(), minlength=STORED_VALUES), replace(CAMERA, depth_scale=scale))


def written(folder: Path, stored: Stored, scale: float = 0.001) -> Path:
    """Write a recording of two equal frames of stored values."""
    camera = replace(CAMERA, depth_scale=scale)
    with SequenceWriter(folder, camera) as out:
        for index in range(2):
            out.append(index / 30, stored * np.float64(scale))
    return folder


@pytest.mark.parametrize("wall", [True, False])
@pytest.mark.parametrize("scale", [0.001, 0.0005])
def test_ordinary_depth_has_no_note(wall: bool, scale: float) -> None:
    assert notes((scene(wall) * (0.001 / scale)).astype(np.uint16), scale) == []


def test_a_far_wall_in_coarse_steps_has_no_note() -> None:
    """Kinect v1 at 3 m has steps of 25 mm, so that a third of a wall has one value."""
    stored = scene(wall=False)
    steps = np.rint(np.random.default_rng(1).normal(0, 0.6, CAMERA.shape)).astype(int)
    assert notes(np.where(stored > 0, stored, 3000 + 25 * steps).astype(np.uint16)) == []


@pytest.mark.parametrize("value", [65535, 4000, 10000], ids=["saturated", "a far plane", "clipped at 10 m"])
def test_a_value_that_covers_much_is_named_and_can_be_excluded(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], value: int
) -> None:
    stored = scene(wall=value == 65535)
    stored[stored == 0] = value
    path = written(tmp_path / "made", stored)
    assert main(["info", str(path)]) == 0
    assert f"give --invalid {value}" in capsys.readouterr().out
    assert main(["info", str(path), "--invalid", str(value)]) == 0
    text = capsys.readouterr().out
    assert "--invalid" not in text
    assert "no reading     0.0 %" not in text
    frame = open_sequence(path, reading=ReadingOptions(invalid=(value,)))[0]
    assert frame.depth.max() < 2.2
    assert (frame.depth == 0).sum() == (stored == value).sum()


@pytest.mark.parametrize("values", [(-1,), (65536,), tuple(range(17))])
def test_values_that_no_image_stores_are_refused(values: tuple[int, ...]) -> None:
    with pytest.raises(InputError, match="--invalid must be at most 16 stored values"):
        ReadingOptions(invalid=values)


WRONG_UNITS = {
    "millimetres as fifths": (1.0, 0.0002, "--depth-scale 0.001"),
    "millimetres as tenths": (1.0, 0.0001, "--depth-scale 0.001"),
    "tenths as millimetres": (10.0, 0.001, "--depth-scale 0.0001"),
    "centimetres": (0.1, 0.001, "8 bits"),
}


@pytest.mark.parametrize("kind", WRONG_UNITS)
def test_a_wrong_unit_is_named_with_the_likely_one(kind: str) -> None:
    factor, scale, remedy = WRONG_UNITS[kind]
    (note,) = notes(np.rint(scene() * factor).astype(np.uint16), scale)
    assert remedy in note


def test_raw_disparity_is_named() -> None:
    (possible,) = notes(disparity(scene() / 1000, missing=0))
    assert "if they are raw disparity" in possible
    (note,) = notes(disparity(scene() / 1000))
    assert "raw disparity of Kinect v1" in note
    assert "convert it by" in note


def test_depth_of_8_bits_in_16_is_named() -> None:
    (note,) = notes((scene() / 10).astype(np.uint16), 0.01)
    assert "depth of 8 bits" in note


def test_commands_print_notes_on_standard_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path / "made", scene(), 0.0001)
    assert main(["view", str(path), "--sheet", str(tmp_path / "sheet.png"), "--no-estimate"]) == 0
    assert "note: depth runs from 0.0" in capsys.readouterr().err


def test_a_recording_without_a_hand_states_the_range_and_the_likely_unit(tmp_path: Path) -> None:
    assert "--depth-scale 0.001" in no_hand_note(open_sequence(written(tmp_path / "unit", scene(), 0.0002)))
    assert "nearest objects" in no_hand_note(open_sequence(written(tmp_path / "empty", scene())))
    nothing = written(tmp_path / "nothing", np.zeros(CAMERA.shape, np.uint16))
    assert "no readings" in no_hand_note(open_sequence(nothing))


def disparity(metres: NDArray[np.float64], missing: int = 2047) -> Stored:
    """Raw disparity of Kinect v1."""
    stored = (3.33 - 1 / np.maximum(metres, 0.1)) / 0.00307
    return np.where(metres > 0, stored, missing).astype(np.uint16)


UNUSABLE: dict[str, tuple[Stored, float]] = {
    "a room within half a metre": (scene(), 0.0002),
    "a hand at the lens": (scene(wall=False), 0.0001),
    "a room beyond 4 m": (10 * scene(), 0.001),
    "a room of 11 m": (np.where(scene() > 1000, 3 * scene(), scene()).astype(np.uint16), 0.002),
    "tenths as millimetres": (15 * scene(), 0.001),
    "raw disparity": (disparity(scene() / 1000), 0.001),
    "8 bits": ((scene() / 10).astype(np.uint16), 0.01),
}


@pytest.mark.parametrize("kind", UNUSABLE)
@pytest.mark.parametrize("command", ["track", "calibrate", "compare", "live"])
def test_no_hand_is_tracked_in_depth_that_cannot_be_right(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], kind: str, command: str
) -> None:
    path = written(tmp_path / "made", *UNUSABLE[kind])
    arguments = {"live": ["--source", str(path)], "calibrate": [str(path), "-o", str(tmp_path / "hand.json")]}
    assert main([command, *arguments.get(command, [str(path), "-o", str(tmp_path / "out")])]) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    assert f"give --depth-scale {UNUSABLE[kind][1]:g}" in message
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("scale", [0.001, 0.0005, 0.002])
def test_depth_that_may_be_right_is_accepted(tmp_path: Path, scale: float) -> None:
    check_depth(open_sequence(written(tmp_path / "made", scene(), scale)))


def test_a_stated_unit_is_taken_in_place_of_that_of_the_camera(tmp_path: Path) -> None:
    path = written(tmp_path / "made", scene(), 0.0002)
    stated = open_sequence(path, reading=ReadingOptions(depth_scale=0.001))
    assert stated.camera.depth_scale == 0.001
    np.testing.assert_allclose(stated[0].depth, 5 * open_sequence(path)[0].depth, rtol=1e-6)
    check_depth(stated)
    check_depth(open_sequence(path, reading=ReadingOptions(depth_scale=0.0002)))
    with pytest.raises(InputError, match=r"--depth-scale 0\.001.*if 0\.2 mm is right"):
        check_depth(open_sequence(path))


@pytest.mark.parametrize("use", [dt.track, dt.calibrate])
def test_functions_refuse_depth_as_the_commands_do(tmp_path: Path, use: Callable[[Path], object]) -> None:
    with pytest.raises(InputError, match=r"--depth-scale 0\.001"):
        use(written(tmp_path / "made", scene(), 0.0002))


def test_a_run_that_explains_little_in_every_frame_is_reported(tmp_path: Path) -> None:
    """Nine agreements of ten were below 0.65 on furniture, and below 0.69 in no run of a hand."""
    sequence = open_sequence(written(tmp_path / "made", scene(), 0.0005))
    assert poor_agreement_note(sequence, np.array([0.5, 0.9, 0.4, 0.85, 0.3])) is None
    assert poor_agreement_note(sequence, np.zeros(0)) is None
    note = poor_agreement_note(sequence, np.array([0.5, 0.6, 0.62, 0.4]))
    assert note is not None
    assert "no hand: nine poses of ten explain at most 61 %" in note
    assert "depth runs from" in note


def test_unreadable_frames_are_left_out_of_the_sample(tmp_path: Path) -> None:
    path = written(tmp_path / "made", scene())
    (path / "depth/0.000000.png").write_bytes(b"")
    assert sampled_histogram(open_sequence(path)).sum() == CAMERA.width * CAMERA.height


def encoded(suffix: str, image: NDArray[Any]) -> bytes:
    return cv2.imencode(suffix, image)[1].tobytes()


def array_file(depth: Stored) -> bytes:
    from io import BytesIO

    file = BytesIO()
    np.save(file, depth)
    return file.getvalue()


PICTURES: dict[str, tuple[Callable[[Stored], bytes], str]] = {
    "8 bits": (lambda d: encoded(".png", (d / 16).astype(np.uint8)), "8 bits have lost the depth"),
    "colourised": (
        lambda d: encoded(".png", cv2.applyColorMap((d / 16).astype(np.uint8), cv2.COLORMAP_JET)),
        "export the depth itself",
    ),
    "packed in channels": (
        lambda d: encoded(".png", np.dstack([d & 255, d >> 8, 0 * d]).astype(np.uint8)),
        "unpack depth in channels",
    ),
    "16 bits in three channels": (lambda d: encoded(".png", np.dstack([d, d, d])), "one of 16 bits"),
    "JPEG": (lambda d: encoded(".jpg", (d / 16).astype(np.uint8)), "save the depth again as PNG"),
    "float TIFF": (lambda d: encoded(".tiff", (d / 1000).astype(np.float32)), "is a TIFF, no PNG: save 16-bit PNG"),
    "16-bit TIFF": (lambda d: encoded(".tiff", d), "is a TIFF, no PNG"),
    "an array": (array_file, "array of numpy, no PNG"),
}


@pytest.mark.parametrize("kind", PICTURES)
def test_depth_in_another_form_is_refused_with_the_remedy(tmp_path: Path, kind: str) -> None:
    make, message = PICTURES[kind]
    path = written(tmp_path / "made", scene())
    for image in (path / "depth").iterdir():
        image.write_bytes(make(scene()))
    with pytest.raises(InputError, match=message):
        list(open_sequence(path))
