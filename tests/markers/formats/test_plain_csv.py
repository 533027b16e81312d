"""Test plain CSV: header, gaps, time, damage, and writing."""

from pathlib import Path

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.formats.registry import read_capture, write_capture

HEADER = "A-X,A-Y,A-Z,L-B-1-X,L-B-1-Y,L-B-1-Z"


def saved(tmp_path: Path, *lines: str) -> Path:
    path = tmp_path / "capture.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_numbers_labels_gaps_and_defaults(tmp_path: Path) -> None:
    path = saved(tmp_path, HEADER, "1,2,3,30,40,50", "nan,nan,nan,31,41,", "0,0,0,32,42,52")
    capture = read_capture(path)
    assert capture.labels == ("A", "L-B-1")
    np.testing.assert_allclose(capture.positions[0], [[0.001, 0.002, 0.003], [0.03, 0.04, 0.05]])
    np.testing.assert_array_equal(
        np.isnan(capture.positions).all(axis=-1), [[False, False], [True, True], [True, False]]
    )
    assert capture.rate == 120
    assert any("1 samples are 0 0 0" in note for note in capture.notes)
    assert any("120 Hz" in note for note in capture.notes)
    assert any("mm is taken" in note for note in capture.notes)


def test_the_user_states_rate_and_unit(tmp_path: Path) -> None:
    capture = read_capture(saved(tmp_path, HEADER, "1,2,3,30,40,50"), rate=100, unit="m")
    assert capture.rate == 100
    assert capture.positions[0, 1, 2] == 50


def test_missing_rows_become_gaps(tmp_path: Path) -> None:
    rows = [f"{0.01 * k:.2f},1,2,3,30,40,{k}" for k in (0, 1, 2, 5, 6)]
    capture = read_capture(saved(tmp_path, "time," + HEADER, *rows))
    assert capture.rate == pytest.approx(100)
    np.testing.assert_allclose(capture.positions[:, 1, 2] * 1000, [0, 1, 2, np.nan, np.nan, 5, 6])
    assert any("2 frames have no row" in note for note in capture.notes)


@pytest.mark.parametrize(
    ("lines", "match"),
    [
        ((HEADER, "1,2,3,4,5,6", "1,2,3,4,5"), "line 3: expected 6 cells"),
        ((HEADER, "1,2,3,4,5,6", "", "1,2,3,4,5,6,7"), "line 4: expected 6 cells"),
        ((HEADER, "1,2,3,4,x,6"), "line 2, cell 5: expected a number or a blank, found 'x'"),
        ((HEADER, "1,2,3,4,1_0,6"), "line 2, cell 5"),
        ((HEADER, "1,2,3,4,inf,6"), "line 2, cell 5"),
        ((HEADER, "1,2,3,4,1e300,6"), "line 2, cell 5"),
        ((HEADER,), "at least one frame"),
        ((HEADER + ",B-X", "1,2,3,4,5,6,7"), "line 1: expected three columns"),
        (("A-X,A-Y,A-Z,B-X,C-Y,B-Z", "1,2,3,4,5,6"), "line 1, cell 4"),
        (("time," + HEADER, "0,1,2,3,4,5,6", "0,1,2,3,4,5,6"), "line 3: times must increase"),
        (("frame," + HEADER, "1.5,1,2,3,4,5,6"), "line 2: expected the whole number"),
        (("frame," + HEADER, ",1,2,3,4,5,6"), "line 2, cell 1: expected a number"),
        (("name,age", "1,2"), "must be .* found another format"),
    ],
)
def test_damage_is_reported_with_its_line(tmp_path: Path, lines: tuple[str, ...], match: str) -> None:
    with pytest.raises(InputError, match=match):
        read_capture(saved(tmp_path, *lines))


def test_a_written_file_reads_back_equal(tmp_path: Path) -> None:
    positions = np.random.default_rng(1).normal(size=(5, 4, 3)) * 0.05
    positions[2, 1] = np.nan
    capture = MarkerCapture(200.0, ("thumb", "ring tip", "left:a", "right:a"), positions, first_frame=7)
    path = tmp_path / "out.csv"
    write_capture(path, capture)
    back = read_capture(path)
    assert (back.rate, back.labels, back.first_frame) == (200.0, capture.labels, 7)
    np.testing.assert_allclose(back.positions, positions, rtol=1e-15)
