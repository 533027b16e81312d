"""`view`, `video` and `export` of marker folders."""

from pathlib import Path

import cv2
import pytest

from depthtrack.cli import main
from depthtrack.markers.folder.writing import write_marker_folder
from tests.support.markers import filled_hands, labelled_hands


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    labelled, out = labelled_hands(frames=12, sides=("right", "left")), tmp_path_factory.mktemp("markers") / "out"
    write_marker_folder(out, labelled, filled=filled_hands(labelled))
    return out


def test_a_sheet_shows_the_chosen_frames(folder: Path, tmp_path: Path) -> None:
    assert main(["view", str(folder), "--sheet", str(tmp_path / "one.png"), "--frames", "3"]) == 0
    assert main(["view", str(folder), "--sheet", str(tmp_path / "four.png"), "--count", "4"]) == 0
    one, four = (cv2.imread(str(tmp_path / name)) for name in ("one.png", "four.png"))
    assert one is not None
    assert four is not None
    assert four.shape[1] > 3 * one.shape[1]


def test_a_video_of_all_models(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["video", str(folder), "-o", str(tmp_path / "out.mp4"), "--height", "48"]) == 0
    assert "3 frames" in capsys.readouterr().out
    assert main(["view", str(folder), "--video", str(tmp_path / "view.mp4")]) == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--strip", "strip.png"], "--strip does not apply to markers"),
        (["--frames", "12", "--sheet", "sheet.png"], "--frames must be from 0 to 11"),
    ],
)
def test_an_option_of_recordings_is_rejected(
    arguments: list[str], message: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["view", str(folder), *arguments]) == 2
    assert message in capsys.readouterr().err


def test_an_export_needs_the_run_of_one_hand(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out.csv"
    assert main(["export", str(folder), "-o", str(out)]) == 2
    assert f"found {folder / 'right'}, {folder / 'left'}" in capsys.readouterr().err
    assert main(["export", str(folder / "left"), "-o", str(out)]) == 0
    one = tmp_path / "one"
    write_marker_folder(one, labelled_hands(frames=3))
    assert main(["export", str(one), "-o", str(out)]) == 0
    assert len(out.read_text().splitlines()) == 4
