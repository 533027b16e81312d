"""The commands that fill gaps and compare filling methods."""

import json
from pathlib import Path

import numpy as np
import pytest

from depthtrack.cli import main
from depthtrack.evaluation.gap_comparison import cut_stretches
from depthtrack.markers.filled_capture import Filling
from depthtrack.markers.folder.contents import Source
from depthtrack.markers.folder.reading import MarkerFolder
from depthtrack.markers.folder.writing import write_marker_folder
from tests.markers.filling.captures import cut, hand, labelled, poses


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("fill") / "labelled"
    whole = hand().positions(poses())
    write_marker_folder(path, labelled(cut(whole, ("index_tip", 100, 140), ("ring_tip", 200, 330)), poses()))
    return path


def test_a_folder_is_filled(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "filled"
    assert main(["markers", "fill", str(folder), "-o", str(out), "--longest", "0.5", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["markers"]
    assert [(row["marker"], row["gaps"], row["filled"]) for row in rows] == [("index_tip", 1, 1), ("ring_tip", 1, 0)]
    read = MarkerFolder.load(out)
    assert read.filled is not None
    assert read.contents.configuration["filling"]["longest"] == 0.5
    assert (read.filled.how[0][100:140, hand().labels.index("index_tip")] == Filling.SMOOTHED).all()
    assert (out / "gaps-1.png").stat().st_size > 1000


def test_the_method_of_the_paper_can_be_chosen(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["markers", "fill", str(folder), "-o", str(tmp_path / "paper"), "--method", "paper", "--no-pictures"]
    assert main(arguments) == 0
    assert "interpolated" in capsys.readouterr().out


def test_an_unusable_option_gives_one_sentence(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["markers", "fill", str(folder), "-o", str(tmp_path / "no"), "--longest", "-1"]) == 2
    assert "--longest must be from" in capsys.readouterr().err
    assert main(["markers", "fill", str(tmp_path / "nothing"), "-o", str(tmp_path / "no")]) == 2


def test_a_folder_whose_source_has_changed_is_not_filled(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "capture.csv"
    source.write_text("one")
    write_marker_folder(tmp_path / "labelled", MarkerFolder.load(folder).labelled, Source.of(source))
    source.write_text("two")
    assert main(["markers", "fill", str(tmp_path / "labelled"), "-o", str(tmp_path / "filled")]) == 2
    assert "has changed since" in capsys.readouterr().err


def test_methods_are_compared(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["markers", "compare-filling", str(folder), "--frames", "20", "30", "--seeds", "1", "--json"]
    assert main([*arguments, "--methods", "smooth", "spline"]) == 0
    rows = json.loads(capsys.readouterr().out)
    median = {row["method"]: row["median_mm"] for row in rows if row["markers"] == "all"}
    assert median["smooth"] < median["spline"]
    assert all(np.isclose(row["filled"], 1) for row in rows)


def test_neighbours_are_cut_together(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole = MarkerFolder.load(folder).labelled
    cut, gaps = cut_stretches(whole, 20, 30, 1, together=3)
    assert len({(gap.marker, gap.start) for gap in gaps}) == len(gaps)
    missing = (whole.columns[0] >= 0) & (cut.columns[0] < 0)
    assert missing.sum() == sum(gap.length for gap in gaps)
    assert missing.sum(axis=1).max() == 3
    arguments = ["markers", "compare-filling", str(folder), "--frames", "20", "30", "--seeds", "1", "--together", "3"]
    assert main([*arguments, "--methods", "spline"]) == 0
    assert "3 neighbours at a time" in capsys.readouterr().out


@pytest.mark.parametrize(
    "wrong",
    [["--methods", "magic"], ["--frames", "30", "20"], ["--frames", "900", "900"], ["--together", "0"]],
)
def test_unusable_comparisons_give_one_sentence(
    wrong: list[str], folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["markers", "compare-filling", str(folder), *wrong]) == 2
    assert capsys.readouterr().err.count("\n") == 1
