"""Test the summary of a capture and the command that prints it."""

import json
from pathlib import Path

import numpy as np
import pytest

from depthtrack.cli import main
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.formats.registry import write_capture
from depthtrack.markers.summary import gap_runs, summarise_capture


def capture() -> MarkerCapture:
    """Return 10 frames of two labelled markers 30 mm apart and an unlabelled one."""
    positions = np.zeros((10, 3, 3))
    positions[:, :, 0] = [0.1, 0.13, 0.5]
    positions[:, 1, 2] = np.arange(10) * 0.001
    positions[2:4, 0] = positions[8:, 0] = np.nan
    positions[1:, 2] = np.nan
    return MarkerCapture(50.0, ("thumb", "index", "*7"), positions, first_frame=12)


@pytest.mark.parametrize(
    ("measured", "runs"),
    [([1, 1], []), ([0, 0], [(0, 2)]), ([0, 1, 0, 0, 1, 0], [(0, 1), (2, 2), (5, 1)])],
)
def test_gap_runs(measured: list[int], runs: list[tuple[int, int]]) -> None:
    assert gap_runs(np.array(measured, dtype=np.bool_)) == runs


def test_summary() -> None:
    summary = summarise_capture(capture())
    assert (summary.frames, summary.first_frame, summary.duration) == (10, 12, 0.2)
    assert (summary.labelled, summary.unlabelled) == (2, 1)
    # Measured segments: frames 0 and 1, and 4 to 7, of the thumb; all frames of the index.
    assert (summary.gaps, summary.segments, summary.longest_gap, summary.missing) == (2, 3, 0.04, 0.2)
    assert summary.points == (1, 2.0, 3)
    assert summary.lowest == (0.1, 0.0, 0.0)
    assert summary.highest == pytest.approx((0.5, 0.0, 0.009))
    assert summary.largest_step == pytest.approx(0.001)
    assert summary.residual is None
    assert [gap.gaps for gap in summary.trajectories] == [2, 0, 1]


def test_the_command_prints_text_and_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "take.c3d"
    write_capture(path, capture())
    assert main(["markers", "info", str(path)]) == 0
    text = capsys.readouterr().out
    for part in ("take.c3d, C3D", "10 over 0.20 s, 50 Hz, the first one is 12", "thumb: 2, longest 2 frames, 40.00 %"):
        assert part in text
    assert main(["markers", "info", str(path), "--rate", "100", "--json"]) == 0
    fields = json.loads(capsys.readouterr().out)
    assert (fields["format"], fields["rate"], fields["unit"], fields["gaps"]) == ("C3D", 100.0, "mm", 2)


def test_a_damaged_file_exits_with_2_and_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "take.c3d"
    write_capture(path, capture())
    path.write_bytes(path.read_bytes()[:1100])
    assert main(["markers", "info", str(path)]) == 2
    message = capsys.readouterr().err
    assert "byte 1100: the file ends early" in message
    assert message.count("\n") == 1
