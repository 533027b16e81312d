"""Small text files from anywhere."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from depthtrack.errors import InputError
from depthtrack.files import read_lines, read_text
from depthtrack.geometry.camera import Camera
from depthtrack.hand.shape import HandShape
from depthtrack.hand.synergies import Synergies
from depthtrack.recording.run_folder import read_configuration, read_rows
from depthtrack.segmentation.skin_colour import SkinColourModel
from depthtrack.synthesis.motion_file import read_table


def test_text_comes_back_without_the_mark_of_spreadsheets(tmp_path: Path) -> None:
    path = tmp_path / "text"
    path.write_bytes(b"\xef\xbb\xbfone\r\ntw\xc3\xb6")
    assert read_text(path) == "one\ntwö"
    assert list(read_lines(path, 100)) == ["one\n", "twö"]


@pytest.mark.parametrize(
    ("data", "message"),
    [(None, "missing or no regular file"), (b"\xff\xfe", "not UTF-8"), (b"x" * 11, "at most 10 bytes long, found 11")],
)
def test_what_is_no_small_text_is_refused(tmp_path: Path, data: bytes | None, message: str) -> None:
    path = tmp_path / "text"
    if data is not None:
        path.write_bytes(data)
    with pytest.raises(InputError, match=message):
        read_text(path, 10)


@pytest.mark.parametrize("read", [Camera.from_json, HandShape.from_json, read_configuration, read_rows])
def test_files_larger_than_memory_are_refused_unread(tmp_path: Path, read: Callable[[Path], object]) -> None:
    for name in ("run.json", "poses.csv"):
        (tmp_path / name).touch()
        os.truncate(tmp_path / name, 1 << 40)  # sparse: it takes no room
    path = tmp_path if read in (read_configuration, read_rows) else tmp_path / "run.json"
    with pytest.raises(InputError, match="bytes long, found 1,099,511,627,776"):
        read(path)


@pytest.mark.parametrize("read", [Synergies.from_json, SkinColourModel.load, read_table])
def test_readers_of_small_files_refuse_large_and_endless_ones(read: Callable[[Path], object], tmp_path: Path) -> None:
    with (tmp_path / "large").open("wb") as file:
        file.truncate(1 << 23)
    with pytest.raises(InputError, match="bytes long, found 8,388,608"):
        read(tmp_path / "large")
    with pytest.raises(InputError, match="no regular file"):
        read(Path("/dev/zero"))
