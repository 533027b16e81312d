"""Colour of folders: in some frames, at another rate, of another size, by another clock."""

from pathlib import Path

import numpy as np
import pytest

from depthtrack.cli import main
from depthtrack.recording import SequenceWriter, open_sequence
from depthtrack.recording.colour_association import associate_colour
from depthtrack.recording.images import write_png
from depthtrack.recording.reading import ReadingOptions
from tests.support.folders import each_line, lines_of, stripped_sample, write_lines
from tests.support.recordings import CAMERA

DEPTH = np.arange(40) / 30


@pytest.fixture
def sample(tmp_path: Path) -> Path:
    return stripped_sample(tmp_path / "sample")


def dropped(folder: Path, *rows: int) -> Path:
    """Remove lines of the list of colour."""
    lines = [f"{t} {name}" for k, (t, name) in enumerate(lines_of(folder / "rgb.txt")) if k not in rows]
    write_lines(folder / "rgb.txt", lines)
    return folder


@pytest.mark.parametrize("rows", [(0,), (0, 1, 2), (1, 3), (4,)], ids=["first", "later", "others", "last"])
def test_colour_is_used_wherever_there_is_some(
    sample: Path, tmp_path: Path, rows: tuple[int, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    sequence = open_sequence(dropped(sample, *rows))
    assert sequence.has_colour
    assert [frame.colour is None for frame in sequence] == [k in rows for k in range(5)]
    share = f"colour in {5 - len(rows)} of 5 frames"
    assert main(["info", str(sample)]) == 0
    assert share in capsys.readouterr().out
    arguments = [
        "--sheet",
        str(tmp_path / "s.png"),
        "--strip",
        str(tmp_path / "t.png"),
        "--video",
        str(tmp_path / "v.mp4"),
    ]
    assert main(["view", str(sample), *arguments, "--no-estimate"]) == 0
    assert share in capsys.readouterr().err


def test_colour_at_another_rate_serves_the_nearest_frames() -> None:
    faster, slower = associate_colour(DEPTH, np.arange(80) / 60), associate_colour(DEPTH, np.arange(14) / 10)
    assert faster.partner == {k: 2 * k for k in range(40)}
    assert set(slower.partner) == set(range(0, 40, 3))
    assert "depth alone in the others" in str(slower.note)


@pytest.mark.parametrize("shift", [0.012, -0.015])
def test_a_shift_in_time_is_reported(shift: float) -> None:
    found = associate_colour(DEPTH, DEPTH + shift)
    assert len(found.partner) >= 39
    assert found.offset == pytest.approx(shift)
    assert f"{1000 * abs(shift):.0f} ms {'after' if shift > 0 else 'before'} the depth" in str(found.note)


def test_slow_cameras_may_be_half_a_period_apart() -> None:
    assert len(associate_colour(np.arange(20) / 12, np.arange(20) / 12 + 0.03).partner) == 20


def test_another_clock_is_paired_by_order_or_not_at_all() -> None:
    by_order = associate_colour(DEPTH, DEPTH + 1.6e9)
    assert by_order.by_order
    assert by_order.partner == {k: k for k in range(40)}
    assert "paired by their order" in str(by_order.note)
    other_count = associate_colour(DEPTH, DEPTH[:30] + 1.6e9)
    assert other_count.partner == {}
    assert "depth alone" in str(other_count.note)
    assert associate_colour(DEPTH, DEPTH + 1 / 60 + 0.6).partner != {}  # within the recording: the nearest in time


def test_colour_of_another_size_is_depth_alone(sample: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for _, name in lines_of(sample / "rgb.txt"):
        write_png(sample / name, np.zeros((2 * CAMERA.height, 3 * CAMERA.width, 3), np.uint8))
    sequence = open_sequence(sample)
    assert not sequence.has_colour
    assert len(list(sequence)) == 5
    assert main(["info", str(sample)]) == 0
    assert "colour of 96x48 pixels is not registered to the depth of 32x24" in capsys.readouterr().out


def test_depth_alone_reads_no_colour(sample: Path) -> None:
    each_line(lambda t, name: f"{t} {name}.missing", ("rgb.txt",))(sample)
    sequence = open_sequence(sample, reading=ReadingOptions(depth_only=True))
    assert not sequence.has_colour
    assert [frame.colour for frame in sequence] == [None] * 5
    assert sequence.damaged_colour == []


def test_damaged_colour_is_counted(sample: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (sample / lines_of(sample / "rgb.txt")[2][1]).write_bytes(b"")
    assert main(["info", str(sample)]) == 0
    text = capsys.readouterr().out
    assert "0 of 5 frames, and the colour of 1" in text
    assert "frame 2 at 0.067 s" in text


def test_every_command_that_reads_a_recording_takes_depth_only(capsys: pytest.CaptureFixture[str]) -> None:
    for command in ("info", "view", "segment", "track", "calibrate", "lift", "compare", "demo", "convert", "live"):
        with pytest.raises(SystemExit):
            main([command, "--help"])
        assert "--depth-only" in capsys.readouterr().out, command


def test_recordings_without_colour_have_no_note(tmp_path: Path) -> None:
    with SequenceWriter(tmp_path / "bare", CAMERA) as out:
        out.append(0.0, np.full(CAMERA.shape, 0.5))
    assert open_sequence(tmp_path / "bare").notes == []
