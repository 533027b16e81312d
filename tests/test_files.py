"""Test bounded reading, atomic writing and JSON."""

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.errors import InputError
from depthtrack.files import (
    compact_json,
    read_bounded,
    read_json,
    read_lines,
    read_text,
    replace_atomically,
    write_atomic,
)
from depthtrack.geometry.camera_files import read_camera
from depthtrack.hand.shape import HandShape
from depthtrack.hand.synergies import Synergies
from depthtrack.recording.run_folder import read_configuration
from depthtrack.recording.run_rows import read_rows
from depthtrack.segmentation.skin_colour import SkinColourModel
from depthtrack.synthesis.motion_file import read_table


def test_text_is_read_without_byte_order_mark(tmp_path: Path) -> None:
    path = tmp_path / "text"
    path.write_bytes(b"\xef\xbb\xbfone\r\ntw\xc3\xb6")
    assert read_text(path) == "one\ntwö"
    assert list(read_lines(path, 100)) == ["one\n", "twö"]


@pytest.mark.parametrize(
    ("data", "message"),
    [(None, "missing or no regular file"), (b"\xff\xfe", "not UTF-8"), (b"x" * 11, "at most 10 bytes long, found 11")],
)
def test_missing_binary_and_long_texts_are_rejected(tmp_path: Path, data: bytes | None, message: str) -> None:
    path = tmp_path / "text"
    if data is not None:
        path.write_bytes(data)
    with pytest.raises(InputError, match=message):
        read_text(path, 10)


@pytest.mark.parametrize("read", [read_camera, HandShape.from_json, read_configuration, read_rows])
def test_files_larger_than_memory_are_rejected_unread(tmp_path: Path, read: Callable[[Path], object]) -> None:
    for name in ("run.json", "poses.csv"):
        (tmp_path / name).touch()
        os.truncate(tmp_path / name, 1 << 40)  # sparse, so it uses no disk
    path = tmp_path if read in (read_configuration, read_rows) else tmp_path / "run.json"
    with pytest.raises(InputError, match="bytes long, found 1,099,511,627,776"):
        read(path)


@pytest.mark.parametrize("read", [Synergies.from_json, SkinColourModel.load, read_table])
def test_readers_of_small_files_reject_large_and_endless_ones(read: Callable[[Path], object], tmp_path: Path) -> None:
    with (tmp_path / "large").open("wb") as file:
        file.truncate(1 << 23)
    with pytest.raises(InputError, match="bytes long, found 8,388,608"):
        read(tmp_path / "large")
    with pytest.raises(InputError, match="no regular file"):
        read(Path("/dev/zero"))


def test_bytes_are_returned_up_to_the_bound(tmp_path: Path) -> None:
    path = tmp_path / "data"
    path.write_bytes(b"\x00\xff")
    assert read_bounded(path, 2) == b"\x00\xff"
    with pytest.raises(InputError, match="at most 1 bytes long, found 2"):
        read_bounded(path, 1)


@pytest.mark.parametrize("content", ["a\nb\r\nö", b"\x00\xff"])
def test_a_written_file_has_the_content_and_no_temporary_file_remains(tmp_path: Path, content: str | bytes) -> None:
    for _ in range(2):
        write_atomic(tmp_path / "file.txt", content)
        assert (tmp_path / "file.txt").read_bytes() == (content.encode() if isinstance(content, str) else content)
        assert [path.name for path in tmp_path.iterdir()] == ["file.txt"]


def _write_half(path: Path) -> None:
    with replace_atomically(path) as temporary:
        assert temporary.suffix == path.suffix
        temporary.write_text("half")
        raise RuntimeError("stop")


def test_a_failing_block_keeps_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "film.mp4"
    path.write_text("old")
    with pytest.raises(RuntimeError, match="stop"):
        _write_half(path)
    assert [(each.name, each.read_text()) for each in tmp_path.iterdir()] == [("film.mp4", "old")]


def test_a_block_that_writes_nothing_keeps_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_text("old")
    with replace_atomically(path):
        pass
    assert path.read_text() == "old"


def test_an_unwritable_path_is_an_input_error_without_remains(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    with pytest.raises(InputError, match=r"cannot write .*folder: Is a directory"):
        write_atomic(tmp_path / "folder", "text")
    with pytest.raises(InputError, match=r"cannot write .*: the folder .*nowhere does not exist: create it first"):
        write_atomic(tmp_path / "nowhere" / "file", "text")
    with (
        pytest.raises(InputError, match=r"cannot write .*: No space left on device"),
        replace_atomically(tmp_path / "a"),
    ):
        raise OSError(28, "No space left on device")
    assert [path.name for path in tmp_path.iterdir()] == ["folder"]


def _number(fields: Any) -> float:
    if fields["x"] < 0:
        raise InputError("x must be positive")
    return float(fields["x"])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "cannot read the number: .*file.json is missing or no regular file"),
        ("{", r"cannot read the number .*file.json: Expecting property name.* \(`make it` writes such a file\)"),
        ("[" * 100_000, "cannot read the number .*file.json: expected at most 40 levels"),
        ('{"x": NaN}', "cannot read the number .*file.json: JSON has no NaN"),
        ("{}", r"file.json: the entry 'x' is missing \(`make it` writes such a file\)"),
        ('{"x": -1}', "file.json: x must be positive"),
        ('{"x": []}', "cannot read the number .*file.json: .*not supported between"),
        ("[1]", "cannot read the number .*file.json: list indices must be"),
        ('{"x": 1%s}' % ("0" * 400), "cannot read the number .*file.json: expected whole numbers of at most 64 bits"),
    ],
)
def test_malformed_json_is_one_sentence(tmp_path: Path, text: str | None, message: str) -> None:
    path = tmp_path / "file.json"
    if text is not None:
        path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_json(path, "the number", _number, made_by="make it")
    assert "\n" not in str(caught.value)


def test_json_is_converted(tmp_path: Path) -> None:
    (tmp_path / "file.json").write_text('{"x": 2}')
    assert read_json(tmp_path / "file.json", "the number", _number) == 2.0


_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=30,
)


@given(_JSON)
def test_compact_json_reads_back(value: Any) -> None:
    assert json.loads(compact_json(value)) == value


def test_compact_json_keeps_short_objects_on_one_line() -> None:
    value = {"name": "a", "size": {"x": [1.0, 2.5]}, "empty": {}, "rows": [{"y": 1}, {"y": 2}], "long": list(range(60))}
    lines = compact_json(value).splitlines()
    assert lines[:8] == [
        "{",
        '  "name": "a",',
        '  "size": {"x": [1.0, 2.5]},',
        '  "empty": {},',
        '  "rows": [',
        '    {"y": 1},',
        '    {"y": 2}',
        "  ],",
    ]
    assert max(map(len, lines)) <= 160
    with pytest.raises(ValueError, match="not JSON compliant"):
        compact_json({"x": float("nan")})
