"""Test TRC, Vicon CSV and Motive CSV."""

import csv
from pathlib import Path

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.formats.registry import read_capture, write_capture

TRC = """PathFileType\t4\t(X/Y/Z)\tcapture.trc
DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames
120.00\t120.00\t3\t2\tmm\t120.00\t1\t3
Frame#\tTime\tthumb\t\t\tindex\t\t\t
\t\tX1\tY1\tZ1\tX2\tY2\tZ2\t

1\t0.000\t1.0\t2.0\t3.0\t14.0\t15.0\t16.0
2\t0.008\t\t\t\t14.0\t15.0\t16.0
3\t0.017\t1.0\t2.0\t3.0\tNaN\tNaN\tNaN
"""
VICON = """Devices
1000
,,Force
Frame,Sub Frame,Fx
,,N
212,0,1.5

Trajectories
200
,,anna:thumb,,,anna:index,,,anna:thumb,,
Frame,Sub Frame,X,Y,Z,X,Y,Z,X,Y,Z
,,mm,mm,mm,mm,mm,mm,mm,mm,mm
212,0,1.0,2.0,3.0,14.0,15.0,16.0,,,
213,0,1.0,2.0,3.0,14.0,15.0,16.0,31.0,32.0,33.0
215,0,,,,14.0,15.0,16.0,31.0,32.0,33.0

Model Outputs
200
"""
MOTIVE = """Format Version,1.23,Take Name,Take 1,Capture Frame Rate,240.0,Export Frame Rate,120.0,Length Units,Meters

,Type,Rigid Body,Rigid Body,Rigid Body,Rigid Body Marker,Rigid Body Marker,Rigid Body Marker,Marker,Marker,Marker,\
Marker,Marker,Marker
,Name,cup,cup,cup,cup:1,cup:1,cup:1,cup:1,cup:1,cup:1,Unlabeled 1042,Unlabeled 1042,Unlabeled 1042
,ID,A,A,A,B,B,B,C,C,C,D,D,D
,,Position,Position,Position,Position,Position,Position,Position,Position,Position,Position,Position,Position
Frame,Time (Seconds),X,Y,Z,X,Y,Z,X,Y,Z,X,Y,Z
0,0.000000,0.1,0.2,0.3,0.11,0.21,0.31,0.12,0.22,0.32,,,
1,0.008333,0.1,0.2,0.3,0.11,0.21,0.31,,,,0.14,0.24,0.34
"""


def read(tmp_path: Path, text: str) -> MarkerCapture:
    path = tmp_path / "capture.txt"
    path.write_text(text)
    return read_capture(path)


def test_trc(tmp_path: Path) -> None:
    capture = read(tmp_path, TRC)
    assert (capture.rate, capture.labels, len(capture), capture.notes) == (120, ("thumb", "index"), 3, ())
    np.testing.assert_allclose(capture.positions[0] * 1000, [[1, 2, 3], [14, 15, 16]])
    np.testing.assert_array_equal(np.isnan(capture.positions).all(axis=-1), [[0, 0], [1, 0], [0, 1]])


def test_a_trc_header_that_contradicts_the_rows_gives_way(tmp_path: Path) -> None:
    capture = read(tmp_path, TRC.replace("120.00\t120.00\t3\t2", "60.00\t60.00\t7\t4"))
    assert capture.rate == pytest.approx(2 / 0.017)
    assert capture.labels == ("thumb", "index")
    assert [note.split(";")[0][:30] for note in capture.notes] == [
        "the header states '4' markers,",
        "the header states '7' frames, ",
        "the header states 60 Hz, the t",
    ]


def test_trc_without_a_row_of_axes_counts_by_its_header(tmp_path: Path) -> None:
    text = TRC.replace("\t\tX1\tY1\tZ1\tX2\tY2\tZ2\t\n\n", "")
    assert read(tmp_path, text).labels == ("thumb", "index")
    with pytest.raises(InputError, match="line 3: NumMarkers must be a number"):
        read(tmp_path, text.replace("3\t2\tmm", "3\t" + "9" * 5000 + "\tmm"))


def test_vicon_csv(tmp_path: Path) -> None:
    capture = read(tmp_path, VICON)
    assert (capture.rate, capture.labels, capture.first_frame) == (200, ("thumb", "index", "thumb_2"), 212)
    np.testing.assert_allclose(capture.positions[:, 2, 0] * 1000, [np.nan, 31, np.nan, 31])
    assert "the prefix 'anna:' is removed from the labels" in capture.notes
    assert "1 frames have no row in the file and are gaps" in capture.notes


def test_motive_csv_takes_the_measured_markers(tmp_path: Path) -> None:
    capture = read(tmp_path, MOTIVE)
    assert (capture.rate, capture.labels, capture.first_frame) == (120, ("1", "*1042"), 0)
    np.testing.assert_allclose(capture.positions[0, 0], [0.12, 0.22, 0.32])
    np.testing.assert_allclose(capture.positions[1, 1], [0.14, 0.24, 0.34])
    assert capture.is_labelled.tolist() == [True, False]


def test_vicon_csv_may_begin_with_blank_lines(tmp_path: Path) -> None:
    assert len(read(tmp_path, "\n\n" + VICON).labels) == 3


def test_motive_columns_without_axis_are_passed_over(tmp_path: Path) -> None:
    lines = MOTIVE.splitlines()
    lines[2:6] = [f"{line},Marker Quality,Marker Quality" for line in lines[2:6]]
    lines[6:] = [lines[6] + ",,", lines[7] + ",0.9,0.8", lines[8]]
    np.testing.assert_allclose(read(tmp_path, "\n".join(lines)).positions[0, 0], [0.12, 0.22, 0.32])


def test_motive_csv_without_measured_markers_takes_the_solved_ones(tmp_path: Path) -> None:
    text = MOTIVE.replace(",Marker", ",Bone").replace("Rigid Body Bone", "Rigid Body Marker")
    capture = read(tmp_path, text)
    np.testing.assert_allclose(capture.positions[:, 0, 0], 0.11)
    assert "the solver's" in capture.notes[0]


@pytest.mark.parametrize(
    ("text", "old", "new", "match"),
    [
        (TRC, "\t14.0\t15.0\t16.0\n2", "\t14.0\t15.0\n2", "line 7: expected 8 cells"),
        (TRC, "3\t0.017", "3\t0.001", "line 9: times must increase"),
        (TRC, "120.00\t120.00\t3", "-5\t120.00\t3", "line 3: DataRate must be a number above 0"),
        (TRC, "Frame#", "Fram#", "line 4: expected Frame#"),
        (VICON, "Trajectories", "Trajectory", "expected a section 'Trajectories'"),
        (VICON, "\n200\n,,anna", "\nzero\n,,anna", "line 9: the rate must be"),
        (VICON, "213,0", "213.5,0", "line 14: expected the whole number"),
        (VICON, "X,Y,Z,X,Y,Z,X,Y,Z", "A,B,C", "line 11: expected Frame, Sub Frame, X, Y, Z"),
        (MOTIVE, "Frame,Time", "Fram,Time", "expected a row 'Frame"),
        (MOTIVE, "Marker", "Bone", "line 7: expected columns X, Y, Z of markers"),
        (MOTIVE, "0.008333,0.1", "0.008333,0.1,0.1", "line 9: expected 14 cells"),
    ],
)
def test_damage_is_reported_with_its_line(tmp_path: Path, text: str, old: str, new: str, match: str) -> None:
    assert old in text
    with pytest.raises(InputError, match=match):
        read(tmp_path, text.replace(old, new))


def opensim_table(path: Path) -> tuple[dict[str, str], list[str], np.ndarray]:
    """Return header, names and numbers of a TRC file, split at tabs as by OpenSim."""
    with path.open(newline="") as file:
        table = list(csv.reader(file, delimiter="\t"))
    assert table[0][:3] == ["PathFileType", "4", "(X/Y/Z)"]
    header = dict(zip(table[1], table[2], strict=True))
    assert table[3][:2] == ["Frame#", "Time"]
    assert table[4][:5] == ["", "", "X1", "Y1", "Z1"]
    assert table[5] == []
    names = [cell for cell in table[3][2:] if cell]
    return header, names, np.array([[float(cell or "nan") for cell in row] for row in table[6:]])


def test_a_written_trc_follows_opensim_and_reads_back_equal(tmp_path: Path) -> None:
    positions = np.random.default_rng(1).normal(size=(5, 3, 3)) * 0.05
    positions[2, 1] = np.nan
    capture = MarkerCapture(200.0, ("thumb", "ring tip", "*3"), positions, first_frame=7)
    path = tmp_path / "out.trc"
    write_capture(path, capture)
    header, names, numbers = opensim_table(path)
    assert (header["DataRate"], header["NumFrames"], header["NumMarkers"], header["Units"]) == ("200", "5", "3", "mm")
    assert tuple(names) == capture.labels
    np.testing.assert_allclose(numbers[:, 0], np.arange(7, 12))
    np.testing.assert_allclose(numbers[:, 1], np.arange(5) / 200)
    np.testing.assert_allclose(numbers[:, 2:].reshape(5, 3, 3), positions * 1000)
    back = read_capture(path)
    assert (back.rate, back.labels, back.first_frame) == (200.0, capture.labels, 7)
    np.testing.assert_allclose(back.positions, positions, rtol=1e-14)
