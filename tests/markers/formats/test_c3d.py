"""Test C3D against ezc3d and against files made byte by byte."""

import struct
from pathlib import Path
from typing import Any, Literal

import ezc3d
import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.formats.registry import read_capture, write_capture
from tests.markers.formats.c3d_bytes import C3dFile


def read(tmp_path: Path, contents: C3dFile | bytes, **options: Any) -> MarkerCapture:
    path = tmp_path / "capture.c3d"
    path.write_bytes(contents.to_bytes() if isinstance(contents, C3dFile) else contents)
    return read_capture(path, **options)


def points(frames: int, count: int, seed: int = 0) -> np.ndarray:
    """Return whole millimetres that every representation holds exactly, with residual 0."""
    positions = np.random.default_rng(seed).integers(1, 1000, (frames, count, 3))
    return np.concatenate([positions, np.zeros((frames, count, 1))], axis=-1).astype(np.float64)


def capture(frames: int = 30, count: int = 6, **fields: Any) -> MarkerCapture:
    """Return positions that single precision holds exactly in millimetres, with gaps."""
    rng = np.random.default_rng(1)
    positions = (rng.normal(size=(frames, count, 3)) * 200).astype(np.float32).astype(np.float64) / 1000
    positions[rng.random((frames, count)) < 0.1] = np.nan
    return MarkerCapture(200.0, tuple(f"marker {k}" for k in range(count)), positions, **fields)


@pytest.mark.parametrize("processor", ["intel", "dec", "mips"])
@pytest.mark.parametrize("scale", [-0.5, 0.5])
def test_processors_and_number_types(tmp_path: Path, processor: Literal["intel", "dec", "mips"], scale: float) -> None:
    stored = points(5, 3)
    stored[1, 0, 3], stored[2, 1, 3], stored[3, 2] = -1, 0x0304, 0
    found = read(tmp_path, C3dFile(stored, ("a", "b", "c"), processor, scale))
    expected = stored[..., :3] * (1 if scale < 0 else scale) / 1000
    expected[1, 0] = np.nan
    np.testing.assert_allclose(found.positions, expected)
    assert found.residuals is not None
    assert found.residuals[2, 1] == pytest.approx(4 * 0.5 / 1000)
    assert (found.rate, found.labels) == (100, ("a", "b", "c"))
    assert found.notes == ("1 samples are 0 0 0 with a residual and are kept",)


def test_analog_values_are_passed_over(tmp_path: Path) -> None:
    stored, analogs = points(4, 2), np.full((4, 6), 7.0)
    extra = {"ANALOG:USED": b"\2\0\2\0\0", "ANALOG:RATE": b"\4\0" + struct.pack("<f", 300) + b"\0"}
    found = read(tmp_path, C3dFile(stored, ("a", "b"), analogs=analogs, extra=extra))
    np.testing.assert_allclose(found.positions * 1000, stored[..., :3])


def test_labels_are_put_in_order(tmp_path: Path) -> None:
    labels = ("hand:thumb", "hand:thumb", "", "*12", "hand:ring", "hand:surplus")
    found = read(tmp_path, C3dFile(points(2, 5), labels))
    assert found.labels == ("thumb", "thumb_2", "*1", "*12", "ring")
    assert [note.split()[0] for note in found.notes] == ["1", "the", "1", "the"]


def test_numbers_that_are_none_are_passed_over(tmp_path: Path) -> None:
    nan = b"\4\1\2" + struct.pack("<ff", np.nan, np.inf) + b"\0"
    extra = {"TRIAL:ACTUAL_START_FIELD": nan, "TRIAL:ACTUAL_END_FIELD": nan, "POINT:LONG_FRAMES": nan}
    assert len(read(tmp_path, C3dFile(points(40, 1), ("a",), extra=extra))) == 40


def test_angles_and_forces_are_left_out(tmp_path: Path) -> None:
    angles = C3dFile(points(2, 1)).strings(("knee",))
    found = read(tmp_path, C3dFile(points(2, 3), ("a", "knee", "b"), extra={"POINT:ANGLES": angles}))
    assert found.labels == ("a", "b")


@pytest.mark.parametrize(("unit", "factor"), [("mm", 0.001), ("cm", 0.01), ("m", 1.0), ("meters", 1.0), ("", 0.001)])
def test_units(tmp_path: Path, unit: str, factor: float) -> None:
    stored = points(2, 3)
    found = read(tmp_path, C3dFile(stored, ("a", "b", "c"), units=unit))
    np.testing.assert_allclose(found.positions, stored[..., :3] * factor)
    assert any("states no unit" in note for note in found.notes) == (unit == "")
    assert any("is it right?" in note for note in found.notes) == (factor > 0.001)


LONG_COUNTS = {
    "trial": {"TRIAL:ACTUAL_START_FIELD": b"\2\1\2\7\0\0\0\0", "TRIAL:ACTUAL_END_FIELD": b"\2\1\2\x76\x11\1\0\0"},
    "long frames": {"POINT:LONG_FRAMES": b"\4\0" + struct.pack("<f", 70000) + b"\0"},
    "float": {"POINT:FRAMES": b"\4\0" + struct.pack("<f", 70000) + b"\0"},
    "length of the file": dict[str, bytes](),
}
"""Parameters that state 70,000 frames from 7 on."""
WRAPPED = 70006 & 0xFFFF
"""The last frame in a header that holds its low 16 bits."""


@pytest.mark.parametrize(
    ("how", "last"), [*((how, 65535) for how in LONG_COUNTS), ("trial", WRAPPED), ("float", WRAPPED)]
)
def test_more_frames_than_the_header_counts(tmp_path: Path, how: str, last: int) -> None:
    stored = np.ones((70000, 1, 4))
    stored[:, 0, 3] = 0
    found = read(tmp_path, C3dFile(stored, ("a",), first_frame=7, extra=LONG_COUNTS[how], header={5: last}))
    assert (len(found), found.first_frame) == (70000, 7)
    assert "the first frame in the file is 7" in found.notes
    assert "the header counts to 65,535" in found.notes[0]


@pytest.mark.parametrize("header", [{2: 2}, {5: 3}, {9: 4}, {3: 1}])
def test_a_damaged_header_yields_to_the_sizes_that_fill_the_file(tmp_path: Path, header: dict[int, int]) -> None:
    stored = points(32, 3)
    extra = {"ANALOG:USED": b"\2\0\0\0\0"}
    found = read(tmp_path, C3dFile(stored, ("a", "b", "c"), extra=extra, header=header))
    np.testing.assert_allclose(found.positions * 1000, stored[..., :3])
    assert found.notes[0].startswith("the header and the parameters state different sizes; 32 frames of 3 points")


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (lambda data: data[:600], "at least 1024 bytes"),
        (lambda data: data[:-512], "byte 2560: the file ends early: 40 frames of 3 points need"),
        (lambda data: data[:515] + b"\1" + data[516:], "byte 515: expected the processor"),
        (lambda data: data.replace(b"RATE", b"RATE\xff\xff"), "byte [0-9]+: a parameter leaves"),
        (lambda data: data.replace(b"LABELS\x0a\0\xff", b"LABELS\x0a\0\x03"), "no valid type"),
        (lambda data: data.replace(b"LABELS\x0a\0\xff\2\1\3", b"LABELS\x0a\0\xff\2\1\xff"), "'LABELS' need 255 bytes"),
        (lambda data: data[:1024] + b"\0\0\x80\x7f" + data[1028:], "byte 1024: expected a coordinate below"),
    ],
)
def test_damage_is_reported_with_its_byte(tmp_path: Path, change: Any, match: str) -> None:
    data = C3dFile(points(40, 3), ("a", "b", "c")).to_bytes()
    with pytest.raises(InputError, match=match):
        read(tmp_path, change(data))


@pytest.mark.parametrize(("count", "first_frame"), [(6, 1), (300, 1), (3, 500)])
def test_a_written_file_reads_back_equal_by_ezc3d_too(tmp_path: Path, count: int, first_frame: int) -> None:
    residuals = np.full((30, count), 0.0004)
    written = capture(count=count, first_frame=first_frame, residuals=residuals)
    path = tmp_path / "out.c3d"
    write_capture(path, written)
    back, other = read_capture(path), ezc3d.c3d(str(path))
    assert (back.labels, back.rate, back.first_frame) == (written.labels, written.rate, first_frame)
    np.testing.assert_allclose(back.positions, written.positions, atol=1e-12)
    assert back.residuals is not None
    np.testing.assert_allclose(back.residuals[np.isfinite(back.residuals)], 0.0004, atol=2e-5)
    np.testing.assert_allclose(other["data"]["points"][:3].transpose(2, 1, 0), written.positions * 1000, atol=1e-9)
    assert other["header"]["points"]["first_frame"] == first_frame - 1
    labels = other["parameters"]["POINT"]["LABELS"]["value"]
    if count > 255:
        labels = [*labels, *other["parameters"]["POINT"]["LABELS2"]["value"]]
    assert tuple(labels) == written.labels


def test_a_long_file_reads_back_equal_by_ezc3d_too(tmp_path: Path) -> None:
    written = capture(66000, 2, first_frame=60000)
    path = tmp_path / "out.c3d"
    write_capture(path, written)
    back, other = read_capture(path), ezc3d.c3d(str(path))
    np.testing.assert_allclose(back.positions, written.positions, atol=1e-12)
    assert back.first_frame == 60000
    np.testing.assert_allclose(other["data"]["points"][:3].transpose(2, 1, 0), written.positions * 1000, atol=1e-9)


def test_a_file_of_ezc3d_is_read_equal(tmp_path: Path) -> None:
    contents = ezc3d.c3d()
    positions = capture(20, 270).positions * 1000
    contents["data"]["points"] = positions.transpose(2, 1, 0)
    contents["data"]["analogs"] = np.ones((1, 2, 40))
    parameters = contents["parameters"]
    parameters["POINT"]["RATE"]["value"], parameters["ANALOG"]["RATE"]["value"] = np.array([50.0]), np.array([100.0])
    parameters["POINT"]["LABELS"]["value"] = [f"m{k}" for k in range(270)]
    parameters["ANALOG"]["LABELS"]["value"] = ["force", "moment"]
    parameters["POINT"]["UNITS"]["value"] = ["mm"]
    contents.write(str(tmp_path / "e.c3d"))
    found = read_capture(tmp_path / "e.c3d")
    assert (found.rate, found.labels) == (50.0, tuple(f"m{k}" for k in range(270)))
    np.testing.assert_allclose(found.positions * 1000, positions, atol=1e-9)


def test_a_label_that_is_too_long_is_refused(tmp_path: Path) -> None:
    written = MarkerCapture(100.0, ("x" * 200,), np.zeros((1, 1, 3)))
    with pytest.raises(InputError, match="at most 127 bytes"):
        write_capture(tmp_path / "out.c3d", written)
    assert not list(tmp_path.iterdir())
