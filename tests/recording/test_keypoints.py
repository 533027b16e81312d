"""Files of 2D keypoints: columns, times and faults."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.errors import InputError
from depthtrack.hand.kinematics import KEYPOINT_NAMES
from depthtrack.recording.keypoints import COLUMNS, HEADER, LANDMARK_NAMES, keypoint_cells, read_keypoints
from depthtrack.recording.sequence import ImageKeypoints
from tests.support.recordings import TIMES, write_sample


def keypoints(seed: int, missing: float = 0.2) -> ImageKeypoints:
    """Return random keypoints with the digits that a file keeps."""
    rng = np.random.default_rng(seed)
    pixels, confidence = rng.uniform(-10, 700, (21, 2)).round(3), rng.uniform(0.1, 1, 21).round(3)
    unknown = rng.random(21) < missing
    pixels[unknown], confidence[unknown] = np.nan, 0
    return ImageKeypoints(pixels, confidence, (None, "left", "right")[seed % 3])


def write(path: Path, times: tuple[float, ...] = TIMES) -> Path:
    rows = [",".join([str(time), *keypoint_cells(keypoints(seed))]) for seed, time in enumerate(times)]
    path.write_text("\n".join([",".join(HEADER), *rows]) + "\n")
    return path


def test_names_are_mediapipes_in_the_order_of_ours() -> None:
    ours = [name.replace("index_finger", "index").replace("middle_finger", "middle") for name in LANDMARK_NAMES]
    ours = [name.replace("ring_finger", "ring").replace("pinky", "little") for name in ours]
    assert tuple(ours) == KEYPOINT_NAMES


def test_a_file_gives_back_what_was_written(tmp_path: Path) -> None:
    found = read_keypoints(write(tmp_path / "keypoints.csv"))
    assert found.timed
    np.testing.assert_array_equal(found.keys, TIMES)
    for seed in range(len(TIMES)):
        expected = keypoints(seed)
        np.testing.assert_array_equal(found[seed].pixels, expected.pixels)
        np.testing.assert_array_equal(found[seed].confidence, expected.confidence)
        assert found[seed].side == expected.side


def test_frames_have_the_nearest_row_within_half_an_interval(tmp_path: Path) -> None:
    found = read_keypoints(write(tmp_path / "keypoints.csv", (0.01, 0.03, 0.3)))
    assert found.rows([0.0, 0.033, 0.066, 0.1, 0.133]).tolist() == [0, 1, -1, -1, -1]
    assert found.rows([0.0]).tolist() == [0]


def test_frames_can_be_numbered(tmp_path: Path) -> None:
    path = tmp_path / "keypoints.csv"
    cells = [",".join(keypoint_cells(replace(keypoints(seed), side=None))[1:]) for seed in range(2)]
    path.write_text(f"frame,{','.join(COLUMNS)}\n1,{cells[0]}\n7,{cells[1]}\n")
    found = read_keypoints(path)
    assert found.rows([0.0, 0.1, 0.2]).tolist() == [-1, 0, -1]
    assert found.side is None


def test_the_side_is_that_of_most_images(tmp_path: Path) -> None:
    # One row in three states no side; left is stated one row earlier than right.
    assert read_keypoints(write(tmp_path / "keypoints.csv", (0.0, 1.0))).side == "left"


def test_attached_keypoints_follow_the_frames(tmp_path: Path) -> None:
    from depthtrack.recording import open_sequence

    recording = open_sequence(write_sample(tmp_path / "recording"))
    found = read_keypoints(write(tmp_path / "keypoints.csv", TIMES[1:3]))
    frames = list(found.attach(recording, recording.timestamps))
    assert [frame.keypoints is not None for frame in frames] == [False, True, True, False, False]
    assert frames[1].keypoints is not None
    np.testing.assert_array_equal(frames[1].keypoints.pixels, keypoints(0).pixels)


def line(number: int, change: Callable[[list[str]], object]) -> Callable[[list[str]], None]:
    """Return a change of the cells of a line, numbered from 1."""

    def edit(lines: list[str]) -> None:
        cells = lines[number - 1].split(",")
        change(cells)
        lines[number - 1] = ",".join(cells)

    return edit


FAULTS: dict[str, tuple[Callable[[list[str]], object], str]] = {
    "no rows": (lambda lines: lines.__delitem__(slice(1, None)), "must hold rows below its header"),
    "other header": (
        line(1, lambda cells: cells.__setitem__(2, "palm_x")),
        "the header must be 'timestamp' or 'frame'",
    ),
    "no header": (lambda lines: lines.pop(0), "the header must be"),
    "a cell less": (line(3, lambda cells: cells.pop()), "line 3: expected 65 cells as in the header, found 64"),
    "time stands still": (line(3, lambda cells: cells.__setitem__(0, "0")), "line 3: expected more than 0, found 0"),
    "no time": (
        line(2, lambda cells: cells.__setitem__(0, "soon")),
        "line 2: expected a time in seconds, found 'soon'",
    ),
    "NaN": (line(2, lambda cells: cells.__setitem__(2, "nan")), "line 2: wrist_x must be a number from -100000"),
    "far away": (line(2, lambda cells: cells.__setitem__(3, "1e9")), "line 2: wrist_y must be a number"),
    "percent": (line(2, lambda cells: cells.__setitem__(4, "50")), "wrist_confidence must be a number from 0 to 1"),
    "both hands": (line(2, lambda cells: cells.__setitem__(1, "both")), "the side must be right, left or blank"),
    "terminal codes": (line(2, lambda cells: cells.__setitem__(1, "\x1b[2J")), r"\\x1b\[2J"),
    "long line": (line(2, lambda cells: cells.__setitem__(2, "0" * 5000)), "line 2: a line must have at most 4096"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_gives_one_sentence(name: str, tmp_path: Path) -> None:
    change, message = FAULTS[name]
    path = write(tmp_path / "keypoints.csv")
    lines = path.read_text().splitlines()
    change(lines)
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(InputError, match=message) as refusal:
        read_keypoints(path)
    assert str(refusal.value).isprintable()


@given(text=st.text(st.characters(codec="utf-8"), max_size=80), place=st.integers(0, 64))
def test_any_cell_is_read_or_refused(text: str, place: int, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = write(tmp_path_factory.mktemp("cells") / "keypoints.csv")
    lines = path.read_text().splitlines()
    line(2, lambda cells: cells.__setitem__(place, text))(lines)
    path.write_text("\n".join(lines) + "\n")
    try:
        found = read_keypoints(path)
    except InputError:
        return
    assert np.all((found.confidence >= 0) & (found.confidence <= 1))
