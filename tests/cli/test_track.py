"""Test `depthtrack track` and `evaluate` on a small synthetic recording, killed and resumed."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import depthtrack as dt
from depthtrack.calibration.calibrate import Calibration, Measured
from depthtrack.cli import main
from depthtrack.cli.track import _rate_text
from depthtrack.errors import InputError
from depthtrack.evaluation.replay import Replay
from depthtrack.hand.shape import HandShape
from depthtrack.recording import open_sequence
from depthtrack.recording.run_folder import Run, read_configuration
from depthtrack.rendering.raster import RasterScorer
from tests.support.runs import synthesise

FRAMES = 14
RESOLUTION = 64
_QUICK = (
    "--hand",
    "average",
    "--side",
    "right",
    "--tracker",
    "pso",
    "--resolution",
    str(RESOLUTION),
    "--generations",
    "12",
    "--threads",
    "1",
    "--start",
    "truth",
)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return synthesise(tmp_path_factory.mktemp("made") / "everyday", FRAMES)


@pytest.fixture(scope="module")
def run(recording: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "whole"
    assert main(["track", str(recording), "-o", str(folder), *_QUICK]) == 0
    return folder


def test_a_run_follows_the_hand(recording: Path, run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["evaluate", str(run), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["frames"] == FRAMES
    assert report["lost_frames"] == 0
    assert 0 < report["endpoint_error_mm"]["mean"] < 6
    assert 0 < report["angle_error_deg"]["median"] < 8
    assert report["endpoint_error_mm"]["p95"] <= report["endpoint_error_mm"]["max"]
    assert report["ms_per_frame"]["median"] > 0
    poses, truth = Run.load(run).poses, open_sequence(recording).ground_truth
    assert truth is not None
    assert truth.poses is not None
    palm_mm = 1000 * np.linalg.norm(poses[:, :3] - truth.poses[:, :3], axis=1)
    assert palm_mm.max() < 10


def test_a_killed_run_resumes_to_the_same_poses(recording: Path, run: Path, tmp_path: Path) -> None:
    folder = tmp_path / "killed"
    command = [sys.executable, "-m", "depthtrack", "track", str(recording), "-o", str(folder), *_QUICK]
    # The first frames compile or load the kernels, so the run lasts long enough to be killed.
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline and process.poll() is None:
        if (folder / "poses.csv").exists() and len((folder / "poses.csv").read_text().splitlines()) > 3:
            os.kill(process.pid, signal.SIGKILL)
            break
        time.sleep(0.002)
    process.wait()
    before = len(Run.load(folder).index)
    assert before >= 2
    assert main(["track", str(recording), "-o", str(folder), *_QUICK, "--resume"]) == 0
    assert (folder / "poses.csv").read_bytes() == (run / "poses.csv").read_bytes()


def test_a_replay_segments_the_frames_of_a_run_to_the_same_bits(run: Path) -> None:
    """The stored energies come back bit for bit; another segmentation would change them."""
    replay = Replay.open(Run.load(run))
    with RasterScorer(replay.hand) as scorer:
        for replayed in replay:
            assert replayed.observation is not None
            assert replayed.estimate.pose is not None
            scorer.set_target(replayed.observation.reduced(RESOLUTION))
            assert scorer.score(replayed.estimate.pose[None])[0] == replayed.estimate.energy


def test_the_text_contains_the_metrics(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["evaluate", str(run)]) == 0
    text = capsys.readouterr().out
    assert "endpoint_error_mm" in text
    assert "ms_per_frame" in text


def test_several_runs_give_a_json_array(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["evaluate", str(run), str(run), "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)) == 2


def test_a_recording_without_true_poses_cannot_start_from_them(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    import shutil

    blind = tmp_path / "blind"
    shutil.copytree(recording, blind)
    (blind / "hand_poses.csv").unlink()
    (blind / "joints.csv").unlink()
    assert main(["track", str(blind), "-o", str(tmp_path / "run"), "--start", "truth"]) == 2
    assert "--start auto" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


def test_a_hand_is_measured_unless_one_is_given(
    recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The measurement itself is replaced; its tests are in tests/calibration."""
    hand, nothing = HandShape(side="left", scale=0.93), np.zeros((0, 27))
    sizes = {"hand_length": Measured(178.0, 2.0, 0.9)}
    found = Calibration(hand, sizes, 0.12, 3.0, 1.0, (), nothing, nothing)
    monkeypatch.setattr("depthtrack.api.measuring.calibrate_either_side", lambda *_: found)
    monkeypatch.setattr("depthtrack.api.measuring.calibrate_side", lambda *_: found)
    short = ("--tracker", "ik", "--frames", "1", "--resolution", str(RESOLUTION))
    run = tmp_path / "run"
    assert main(["track", str(recording), "-o", str(run), *short]) == 0
    printed = capsys.readouterr().out
    assert "a left hand, a right one fits 12 % worse; 178 mm long" in printed
    assert "the side is uncertain: give --side" in printed
    assert read_configuration(run)["hand"]["scale"] == 0.93
    assert main(["track", str(recording), "-o", str(run), *short, "--resume"]) == 0
    assert "mm long" not in capsys.readouterr().out
    assert main(["track", str(recording), "-o", str(tmp_path / "given"), *short, "--hand", "truth"]) == 0
    assert "mm long" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("more", "expected"),
    [
        (["-o", "{run}"], "already holds a run"),
        (["-o", "{new}", "--tracker", "ik", "--synergies", "leap", "--components", "99"], "components"),
        (["-o", "{new}", "--tracker", "lift"], "must have keypoints"),
    ],
)
def test_mistakes_are_found_before_the_hand_is_measured(
    recording: Path,
    run: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    more: list[str],
    expected: str,
) -> None:
    def measured(*_: object) -> None:
        raise AssertionError("the hand was measured")

    monkeypatch.setattr("depthtrack.api.measuring.calibrate_either_side", measured)
    options = [each.format(run=run, new=tmp_path / "new") for each in more]
    assert main(["track", str(recording), *options]) == 2
    assert expected in capsys.readouterr().err
    monkeypatch.setattr("depthtrack.api.choices.calibrate_either_side", measured)
    with pytest.raises(InputError, match="components must be from 1 to 20"):
        dt.tracker_config("ik", synergies="leap", components=99)
    with pytest.raises(InputError, match="must have keypoints"):
        dt.track(recording, tracker="lift")
    with pytest.raises(InputError, match="already holds a run"):
        dt.track(recording, out=run)


def test_the_average_hand_is_tracked_if_none_can_be_measured(
    recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refused(*_: object) -> None:
        raise InputError("a hand was tracked in 2 of 32 frames")

    monkeypatch.setattr("depthtrack.api.measuring.calibrate_side", refused)
    command = ["track", str(recording), "-o", str(tmp_path / "run"), "--tracker", "ik", "--frames", "1"]
    assert main([*command, "--side", "left"]) == 0
    assert "the average adult's left hand is assumed: a hand was tracked in 2 of" in capsys.readouterr().out
    assert read_configuration(tmp_path / "run")["hand"]["side"] == "left"


def test_errors_are_one_sentence_without_traceback(
    recording: Path, run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for arguments, expected in (
        (["track", str(recording), "-o", str(run)], "--resume"),
        (["track", str(recording), "-o", str(run), *_QUICK, "--resume", "--seed", "9"], "options.seed"),
        (["track", str(tmp_path / "nothing"), "-o", str(tmp_path / "r")], "nothing"),
        (["track", str(recording), "-o", str(tmp_path / "r"), "--frames", "-1"], "--frames must be from 1"),
        (["evaluate", str(tmp_path)], "holds no run"),
        (["evaluate", str(run), "--sequence", str(tmp_path)], str(tmp_path)),
    ):
        assert main(arguments) == 2
        message = capsys.readouterr().err
        assert expected in message
        assert "Traceback" not in message


def test_the_rate_leaves_out_the_first_frame() -> None:
    assert _rate_text([5.0, 5.5, 6.0]) == ", 2 frames a second"
    assert _rate_text([5.0]) == _rate_text([]) == ""
