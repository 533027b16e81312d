"""`depthtrack lift`: poses, size and side of a hand from keypoints, and refusals."""

from pathlib import Path

import numpy as np
import pytest

import depthtrack as dt
from depthtrack.cli import main
from depthtrack.recording.keypoints import read_keypoints
from tests.support.keypoints import mean_error

FRAMES = 24


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A left hand that is larger than the average, with keypoints."""
    folder = tmp_path_factory.mktemp("lift") / "made"
    scene = ("--model", "skin", "--sensor", "kinect1", "--side", "left", "--scale", "1.15", "--seed", "3")
    frames = ("--frames", str(FRAMES), "--fps", "4", "--keypoints")
    assert main(["synth", "everyday", str(folder), *scene, *frames]) == 0
    return folder


def joint_error(run: Path, made: Path) -> float:
    truth = dt.open_recording(made).ground_truth
    assert truth is not None
    assert truth.joints is not None
    found = dt.joint_track(run)
    known = np.isfinite(found.keypoints).all(axis=(1, 2))
    assert known.mean() > 0.9
    return mean_error(found.keypoints[known], truth.joints[found.index][known])


@pytest.mark.slow
def test_a_recording_is_lifted(made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = tmp_path / "run"
    assert main(["lift", str(made), str(made / "keypoints.csv"), "-o", str(run)]) == 0
    assert "a left hand of 1.1" in (shown := capsys.readouterr().out)
    assert "px from those of the file" in shown
    assert joint_error(run, made) < 0.006
    hand = dt.read_run(run).configuration["hand"]
    assert (hand["side"], hand["scale"]) == ("left", pytest.approx(1.15, rel=0.05))
    assert main(["export", str(run), "-o", str(tmp_path / "joints.csv")]) == 0
    again = dt.lift(made, made / "keypoints.csv", out=tmp_path / "again")
    assert again.poses.tobytes() == dt.read_run(run).poses.tobytes()


@pytest.mark.slow
def test_a_stated_side_that_is_wrong_is_found_by_the_fit(made: Path, tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.csv"
    wrong.write_text((made / "keypoints.csv").read_text().replace(",left,", ",right,"))
    assert read_keypoints(wrong).side == "right"
    assert main(["lift", str(made), str(wrong), "-o", str(tmp_path / "run")]) == 0
    assert joint_error(tmp_path / "run", made) < 0.006


def test_frames_without_keypoints_are_absent(made: Path, tmp_path: Path) -> None:
    lines = (made / "keypoints.csv").read_text().splitlines(keepends=True)
    cut = tmp_path / "cut.csv"
    blank = lines[2].split(",")[0] + ",left" + "," * 63 + "\n"
    cut.write_text("".join([lines[0], lines[1], blank, lines[4]]))
    command = ["lift", str(made), str(cut), "-o", str(tmp_path / "run"), "--hand", "truth", "--no-refine"]
    assert main([*command, "--frames", "4"]) == 0
    assert [status == "absent" for status in dt.read_run(tmp_path / "run").status] == [False, True, True, False]


def test_one_sentence_states_what_is_missing(made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = (made / "keypoints.csv").read_text().splitlines(keepends=True)
    late, blank = tmp_path / "late.csv", tmp_path / "blank.csv"
    late.write_text(lines[0] + "999" + lines[1][lines[1].index(",") :])
    blank.write_text(lines[0] + lines[1].split(",")[0] + "," * 64 + "\n")
    for arguments, message in (
        (["lift", str(made), str(late)], "no row of the keypoints belongs to a frame"),
        (["lift", str(made), str(blank)], "no frame of made has enough keypoints"),
        (["lift", str(made), str(blank), "--side", "file"], "must state a side"),
        (["track", str(made), "--tracker", "lift", "--side", "left"], "give --keypoints FILE.csv"),
    ):
        assert main([*arguments, "-o", str(tmp_path / "run")]) == 2
        assert message in capsys.readouterr().err
