"""The demo: from nothing to a report, and from a recording of one's own without any truth."""

import json
import shutil
from pathlib import Path

import pytest

from depthtrack.cli import main
from depthtrack.recording import open_sequence
from tests.run_samples import synthesise


def test_the_demo_makes_a_report_from_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "demo"
    assert main(["demo", "-o", str(out), "--frames", "3", "--jobs", "1"]) == 0
    assert str(out / "report.html") in capsys.readouterr().out
    rows = json.loads((out / "results.json").read_text())
    assert {(row["recording"], row["tracker"]) for row in rows} == {
        (recording, tracker) for recording in ("skin-hand", "primitive-hand") for tracker in ("pso", "ik")
    }
    assert all(0 < row["endpoint_error_mm"]["mean"] < 30 for row in rows)
    # Each tracker has a home ground, and the page says so.
    kinds = {open_sequence(folder).description["model"] for folder in (out / "recordings").iterdir()}
    assert kinds == {"skin", "primitives"}
    assert (out / "report.html").read_text().count("Home ground") == 2
    # Given again, nothing is made again.
    made = {path: path.stat().st_mtime_ns for path in (*out.glob("recordings/*/*"), *out.glob("runs/*/poses.csv"))}
    assert main(["demo", "-o", str(out), "--frames", "3", "--jobs", "1"]) == 0
    assert made == {path: path.stat().st_mtime_ns for path in made}


def test_a_recording_of_ones_own_needs_no_truth(tmp_path: Path) -> None:
    own = synthesise(tmp_path / "own", 3)
    for name in ("hand_poses.csv", "joints.csv", "hand.json", "sequence.json"):
        (own / name).unlink()
    shutil.rmtree(own / "hand_mask")
    shutil.rmtree(own / "exact_depth", ignore_errors=True)
    assert main(["demo", str(own), "-o", str(tmp_path / "demo"), "--jobs", "1"]) == 0
    rows = json.loads((tmp_path / "demo" / "results.json").read_text())
    assert [row["recording"] for row in rows] == ["own", "own"]
    assert all("endpoint_error_mm" not in row and row["e3d_mm"]["median"] < 6 for row in rows)
    assert "E3D" in (tmp_path / "demo" / "report.html").read_text()


def test_a_demo_of_nothing_is_told_in_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", str(tmp_path / "nowhere"), "-o", str(tmp_path / "demo")]) == 2
    assert "there is no recording" in capsys.readouterr().err
