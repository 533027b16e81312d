"""Opening an unusable folder gives one sentence, for every kind of fault."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from depthtrack.cli import main
from depthtrack.errors import InputError
from depthtrack.recording import ground_truth as truth
from depthtrack.recording import open_sequence
from depthtrack.recording.sequences import tum_lists as lists
from tests.support.recordings import write_sample

Change = Callable[[Path], object]


def text(name: str, content: str) -> Change:
    return lambda folder: (folder / name).write_text(content)


def edit(name: str, old: str, new: str) -> Change:
    def change(folder: Path) -> None:
        before = (folder / name).read_text()
        assert old in before
        (folder / name).write_text(before.replace(old, new, 1))

    return change


def camera(**fields: object) -> Change:
    def change(folder: Path) -> None:
        known = json.loads((folder / "camera.json").read_text())
        (folder / "camera.json").write_text(json.dumps({**known, **fields}))

    return change


def link_image_outside(folder: Path) -> None:
    outside = folder.parent / "outside.png"
    (folder / "depth/0.033000.png").rename(outside)
    (folder / "depth/0.033000.png").symlink_to(outside)


def link_folder_outside(folder: Path) -> None:
    (folder / "depth").rename(folder.parent / "outside")
    (folder / "depth").symlink_to(folder.parent / "outside")


def drop_a_row(folder: Path) -> None:
    lines = (folder / "joints.csv").read_text().splitlines(keepends=True)
    (folder / "joints.csv").write_text("".join(lines[:-1]))


REFUSALS: dict[str, tuple[Change, str]] = {
    # Lists
    "empty list": (text("depth.txt", "# timestamp filename\n\n"), "lists no image"),
    "time is NaN": (edit("depth.txt", "0.033000 ", "nan "), "line 3: expected 'timestamp filename'"),
    "time is infinite": (edit("depth.txt", "0.033000 ", "inf "), "line 3: expected 'timestamp filename'"),
    "time is no number": (edit("depth.txt", "0.033000 ", "soon "), "line 3: expected 'timestamp filename'"),
    "no file name": (edit("depth.txt", " depth/0.033000.png", ""), "line 3: expected 'timestamp filename'"),
    "not text": (lambda folder: (folder / "depth.txt").write_bytes(b"\xff\xfe\x00"), "must be a text file"),
    "colour list broken": (edit("rgb.txt", "0.033000 ", "soon "), r"rgb\.txt, line 3"),
    # Names outside the folder
    "absolute name": (edit("depth.txt", "depth/0.033000.png", "/etc/hostname"), "must lie within the folder"),
    "parent folder": (edit("depth.txt", "depth/0.033000.png", "depth/../../x.png"), "must lie within the folder"),
    "drive letter": (edit("depth.txt", "depth/0.033000.png", "C:x.png"), "must lie within the folder"),
    "backslashes": (edit("depth.txt", "depth/0.033000.png", "..\\\\x.png"), "must lie within the folder"),
    "colour escapes": (edit("rgb.txt", "rgb/0.033000.jpg", "../x.jpg"), "must lie within the folder"),
    "terminal codes": (edit("depth.txt", "depth/0.033000.png", "depth/\x1b[2J.png"), r"\\x1b\[2J"),
    "link to a file outside": (link_image_outside, "must lie within the folder"),
    "link to a folder outside": (link_folder_outside, "must lie within the folder"),
    # Camera
    "no camera": (lambda folder: (folder / "camera.json").unlink(), r"has no camera\.json"),
    "camera is no JSON": (text("camera.json", "fx = 525"), "cannot read the camera file"),
    "camera is a list": (text("camera.json", "[1, 2]"), "must be a JSON object"),
    "camera nests deep": (text("camera.json", "[" * 100_000), "cannot read the camera file"),
    "camera without fx": (text("camera.json", '{"width": 32, "height": 24}'), "must be a JSON object with"),
    "focal length zero": (camera(fx=0), "fx must be a focal length"),
    "focal length negative": (camera(fx=-30.0), "fx must be a focal length"),
    "focal length in metres": (camera(fx=0.004), "fx must be a focal length"),
    "focal length NaN": (camera(fx=float("nan")), "JSON has no NaN"),
    "focal length beyond floats": (camera(fx=10**400), "whole numbers of at most 64 bits"),
    "focal length is text": (camera(fx="525"), "fx must be a focal length"),
    "centre far outside": (camera(cx=1e6), "cx must be a principal point"),
    "width negative": (camera(width=-32), "width must be a whole number"),
    "width absurd": (camera(width=10**9), "width must be a whole number"),
    "depth scale zero": (camera(depth_scale=0), "depth_scale must be metres per depth unit"),
    "depth scale in units per metre": (camera(depth_scale=5000), "depth_scale must be metres per depth unit"),
    # Ground truth and description
    "poses with another header": (edit("hand_poses.csv", "qw", "w"), "the header must be 'timestamp,x,"),
    "pose too short": (edit("hand_poses.csv", "0.033000,", ""), "line 3: expected 28 finite numbers, found 27"),
    "pose not finite": (edit("hand_poses.csv", "0.033000,", "nan,"), "line 3: expected 28 finite numbers"),
    "pose rows out of order": (edit("hand_poses.csv", "0.033000,", "0.9,"), "line 4: timestamps must increase"),
    "pose with a zero quaternion": (edit("hand_poses.csv", ",1.0,0.0,0.0,0.0,", ",0,0,0,0,"), "must have length 1"),
    "joints without a row": (text("joints.csv", ",".join(truth.JOINTS_HEADER)), "must hold rows below its header"),
    "joints empty": (text("joints.csv", ""), "the header must be 'timestamp,wrist_x,"),
    "joints of other frames": (drop_a_row, "must annotate the same timestamps"),
    "hand is no JSON": (text("hand.json", "{"), "cannot read the hand file"),
    "hand nests deep": (text("hand.json", "[" * 100_000), "cannot read the hand file"),
    "hand without fingers": (text("hand.json", "{}"), "'fingers' is missing"),
    "description is no JSON": (text("sequence.json", "motion: wave"), "cannot read the description"),
    "description is a list": (text("sequence.json", "[]"), "expected a JSON object"),
    "description with NaN": (text("sequence.json", '{"noise": NaN}'), "JSON has no NaN"),
    "exact depth scale absurd": (text("sequence.json", '{"exact_depth_scale": 0}'), "must be metres per unit"),
}


def problem_of(folder: Path) -> str:
    """Return the error of opening and reading a recording; an empty text if there is none."""
    try:
        list(open_sequence(folder, on_damage="skip"))
    except InputError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("name", REFUSALS)
def test_an_unusable_folder_gives_one_sentence_and_code_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    change, message = REFUSALS[name]
    folder = write_sample(tmp_path / "sample")
    change(folder)
    with pytest.raises(InputError, match=message):
        open_sequence(folder, on_damage="skip")

    assert main(["info", str(folder)]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("depthtrack info: ")
    assert said.err.count("\n") == 1
    assert "Traceback" not in said.err
    assert str(folder) in said.err


@settings(max_examples=100)
@given(st.data())
def test_any_change_of_a_text_file_gives_a_recording_or_one_sentence(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    folder = write_sample(tmp_path_factory.mktemp("changed") / "sample")
    path = data.draw(st.sampled_from(sorted(path for path in folder.iterdir() if path.is_file())))
    content = path.read_bytes()
    start = data.draw(st.integers(0, len(content)))
    end = data.draw(st.integers(start, min(len(content), start + 20)))
    inserted = data.draw(
        st.binary(max_size=6) | st.sampled_from([b"nan", b"1e999", b"../", b"null", b"{", b"\n", b","])
    )
    path.write_bytes(content[:start] + inserted + content[end:])
    assert "\n" not in problem_of(folder)


def test_too_long_files_are_rejected_before_they_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = write_sample(tmp_path / "sample")
    monkeypatch.setattr(truth, "MAX_TABLE_BYTES", 50)
    with pytest.raises(InputError, match=r"hand_poses\.csv must be at most 50 bytes long, found [\d,]+"):
        open_sequence(folder)
    monkeypatch.setattr(lists, "MAX_LIST_BYTES", 50)
    with pytest.raises(InputError, match=r"depth\.txt must be at most 50 bytes long, found [\d,]+"):
        open_sequence(folder)


def test_a_list_of_too_many_frames_is_rejected(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = write_sample(tmp_path / "sample")
    monkeypatch.setattr(lists, "MAX_FRAMES", 4)
    with pytest.raises(InputError, match="lists more than 4 images"):
        open_sequence(folder)


def test_links_within_the_folder_are_followed(tmp_path: Path) -> None:
    folder = write_sample(tmp_path / "sample")
    (folder / "depth/0.033000.png").rename(folder / "elsewhere.png")
    (folder / "depth/0.033000.png").symlink_to(folder / "elsewhere.png")
    assert len(list(open_sequence(folder))) == 5


def test_masks_outside_the_folder_are_not_read(tmp_path: Path) -> None:
    folder = write_sample(tmp_path / "sample")
    (folder / "hand_mask").rename(tmp_path / "masks")
    (folder / "hand_mask").symlink_to(tmp_path / "masks")
    with pytest.raises(InputError, match="must lie within the folder"):
        open_sequence(folder).hand_mask(0)
