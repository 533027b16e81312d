"""Test the demo: a report on synthetic recordings, and on a recording without ground truth."""

import json
import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from depthtrack.cli import main
from depthtrack.errors import InputError
from depthtrack.hand.shape import HandShape
from depthtrack.recording import open_sequence
from depthtrack.recording.run_folder import read_configuration
from depthtrack.recording.sequence import Sequence
from tests.support.runs import synthesise


@pytest.mark.slow
def test_the_demo_makes_a_report_on_synthetic_recordings(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "demo"
    assert main(["demo", "-o", str(out), "--frames", "3", "--jobs", "1"]) == 0
    assert str(out / "report.html") in capsys.readouterr().out
    rows = json.loads((out / "results.json").read_text())
    assert {(row["recording"], row["tracker"]) for row in rows} == {
        (recording, tracker) for recording in ("skin-hand", "primitive-hand") for tracker in ("hybrid", "pso", "ik")
    }
    assert all(0 < row["endpoint_error_mm"]["mean"] < 30 for row in rows)
    # The only surface of `ik` occurs in one recording, and the page warns of the other one.
    kinds = {open_sequence(folder).description["model"] for folder in (out / "recordings").iterdir()}
    assert kinds == {"skin", "primitives"}
    assert (out / "report.html").read_text().count("Biased comparison") == 1
    # The same command makes nothing again.
    made = {path: path.stat().st_mtime_ns for path in (*out.glob("recordings/*/*"), *out.glob("runs/*/poses.csv"))}
    assert main(["demo", "-o", str(out), "--frames", "3", "--jobs", "1"]) == 0
    assert made == {path: path.stat().st_mtime_ns for path in made}


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """Return a recording with depth and colour only."""
    folder = synthesise(tmp_path / "own", 3)
    for name in ("hand_poses.csv", "joints.csv", "hand.json", "sequence.json"):
        (folder / name).unlink()
    for name in ("hand_mask", "exact_depth"):
        shutil.rmtree(folder / name, ignore_errors=True)
    return folder


def test_a_users_recording_needs_no_ground_truth(own: Path, tmp_path: Path) -> None:
    assert main(["demo", str(own), "-o", str(tmp_path / "demo"), "--jobs", "1", "--no-calibrate"]) == 0
    rows = json.loads((tmp_path / "demo" / "results.json").read_text())
    assert [row["recording"] for row in rows] == ["own"] * 3
    assert all("endpoint_error_mm" not in row and row["e3d_mm"]["median"] < 6 for row in rows)
    assert "E3D" in (tmp_path / "demo" / "report.html").read_text()


def test_the_hand_of_a_users_recording_is_calibrated_once_and_used(
    own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The calibration itself is replaced."""
    calls: list[int] = []

    def measured(sequence: Sequence, *_: Any) -> SimpleNamespace:
        calls.append(len(sequence))
        hand = HandShape(scale=1.07)
        return SimpleNamespace(hand=hand, to_json=hand.to_json)

    monkeypatch.setattr("depthtrack.api.measuring.calibrate_either_side", measured)
    for _ in range(2):
        assert main(["demo", str(own), "-o", str(tmp_path / "demo"), "--jobs", "1"]) == 0
    assert calls == [3]
    for run in (tmp_path / "demo" / "runs").iterdir():
        assert read_configuration(run)["hand"]["scale"] == 1.07


def test_the_average_hand_is_used_if_the_calibration_fails(
    own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refused(*_: Any) -> None:
        raise InputError("this recording shows no open hand")

    monkeypatch.setattr("depthtrack.api.measuring.calibrate_either_side", refused)
    assert main(["demo", str(own), "-o", str(tmp_path / "demo"), "--jobs", "1"]) == 0
    assert "shows no open hand" in capsys.readouterr().out
    for run in (tmp_path / "demo" / "runs").iterdir():
        assert read_configuration(run)["hand"]["scale"] == 1


def test_a_missing_recording_is_reported_in_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", str(tmp_path / "nowhere"), "-o", str(tmp_path / "demo")]) == 2
    assert "there is no recording" in capsys.readouterr().err
