"""Test `depthtrack evaluate --predictions` with labels and with a recording."""

import json
from pathlib import Path

import numpy as np
import pytest

from depthtrack.cli import main
from depthtrack.evaluation.predictions import evaluate_predictions
from depthtrack.export.uvd import write_uvd
from depthtrack.hand.benchmark_joints import BENCHMARKS
from depthtrack.recording import open_sequence
from tests.support.runs import synthesise, true_poses, write_run

MSRA = BENCHMARKS["msra"]
TRUTH = np.random.default_rng(3).uniform([-0.1, -0.1, 0.4], [0.1, 0.1, 0.6], (4, 21, 3))


def test_errors_computed_by_hand(tmp_path: Path) -> None:
    found = TRUTH.copy()
    found[0, 4] += [0.012, 0, 0]  # the fifth joint of MSRA is the tip of the index finger
    found[1] += [0, 0.003, 0.004]
    found[3] = np.nan
    labels, predictions = tmp_path / "labels.txt", tmp_path / "predictions.txt"
    write_uvd(labels, MSRA, TRUTH)
    write_uvd(predictions, MSRA, found)
    evaluation = evaluate_predictions(predictions, MSRA, labels)
    np.testing.assert_allclose(evaluation.points.mean().values, [12 / 21, 5, 0, np.nan], atol=0.01)
    np.testing.assert_allclose(evaluation.by_joint["index_tip"].values, [12, 5, 0, np.nan], atol=0.01)
    assert evaluation.missed_frames == 1
    assert evaluation.left_out_joints == 0
    report = evaluation.to_json()
    assert report["frames"] == 4
    assert report["frames_within_mm"]["10"] == 0.5
    assert report["frames_within_mm"]["20"] == 0.75
    assert report["finger_joint_error_mm"]["index"]["max"] == pytest.approx(5, abs=0.01)


def test_joints_without_a_position_are_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = TRUTH.copy()
    found[0, 4:7] = np.nan
    found[3] = np.nan
    labels, predictions = tmp_path / "labels.txt", tmp_path / "predictions.txt"
    write_uvd(labels, MSRA, TRUTH)
    write_uvd(predictions, MSRA, found)
    arguments = ["evaluate", "--predictions", str(predictions), "--benchmark", "msra", "--labels", str(labels)]
    assert main(arguments) == 0
    printed = capsys.readouterr().out
    assert "1 without a prediction" in printed
    assert "left out: 3 joints" in printed
    assert main([*arguments, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["left_out_joints"] == 3


def test_exported_predictions_have_the_errors_of_the_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recording = synthesise(tmp_path / "everyday", 4)
    poses = true_poses(recording)[:3] + np.array([0.003, 0, 0.004, *np.zeros(24)])
    run, text = write_run(tmp_path / "run", recording, poses), tmp_path / "ours.txt"
    for benchmark in sorted(BENCHMARKS):
        assert main(["export", str(run), "-o", str(text), "--format", benchmark]) == 0
        capsys.readouterr()
        arguments = ["evaluate", "--predictions", str(text), "--benchmark", benchmark, "--sequence", str(recording)]
        assert main([*arguments, "--json"]) == 0
        report = json.loads(capsys.readouterr().out)
        assert report["frames"] == 3
        assert report["joint_error_mm"]["max"] == pytest.approx(5, abs=0.01)
        assert len(report["joint_error_mm_by_joint"]) == len(BENCHMARKS[benchmark].joints)
        assert main(arguments) == 0
        printed = capsys.readouterr().out
        assert "100 % within 10 mm" in printed
        assert all(joint in printed for joint in BENCHMARKS[benchmark].joints)


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ([], "give --benchmark"),
        (["--benchmark", "msra"], "give one of them"),
        (["--benchmark", "msra", "--labels", "{short}"], "has 4 frames, but"),
        (["--benchmark", "nyu", "--labels", "{labels}"], "u v d of the 14 joints of nyu"),
        (["--benchmark", "msra", "--labels", "{labels}", "{folder}"], "--predictions takes neither run folders"),
        (["--benchmark", "msra", "--sequence", "{folder}/gone"], "there is no recording"),
    ],
)
def test_errors_are_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], expected: str
) -> None:
    labels, short = tmp_path / "labels.txt", tmp_path / "short.txt"
    write_uvd(labels, MSRA, TRUTH)
    write_uvd(short, MSRA, TRUTH[:2])
    filled = [option.format(labels=labels, short=short, folder=tmp_path) for option in options]
    assert main(["evaluate", "--predictions", str(labels), *filled]) == 2
    assert expected in capsys.readouterr().err


def test_a_recording_without_joints_or_with_fewer_frames_is_rejected(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording, text = synthesise(tmp_path / "everyday", 2), tmp_path / "a.txt"
    write_uvd(text, MSRA, TRUTH)
    arguments = ["evaluate", "--predictions", str(text), "--benchmark", "msra", "--sequence", str(recording)]
    assert main(arguments) == 2
    assert "has only 2" in capsys.readouterr().err
    for name in ("joints.csv", "hand_poses.csv"):
        (recording / name).unlink()
    assert main(arguments) == 2
    assert "has no joints to compare with" in capsys.readouterr().err
    assert main(["evaluate", "--labels", str(text)]) == 2
    assert main(["evaluate", str(tmp_path), "--labels", str(text)]) == 2
    assert "need --predictions" in capsys.readouterr().err


def test_annotated_joints_of_a_real_recording_have_no_error(real_data: Path, tmp_path: Path) -> None:
    """The joints are written in the format of ICVL."""
    sequence, icvl = open_sequence(real_data / "rgbd" / "open-close"), BENCHMARKS["icvl"]
    truth = sequence.ground_truth
    assert truth is not None
    keypoints = [truth.keypoints_at(float(time)) for time in sequence.timestamps]
    absent = np.full((21, 3), np.nan)
    joints = icvl.from_keypoints([absent if points is None else points for points in keypoints])
    write_uvd(tmp_path / "a.txt", icvl, joints)
    evaluation = evaluate_predictions(tmp_path / "a.txt", icvl, sequence)
    assert evaluation.missed_frames == 0
    assert np.nanmax(evaluation.points.mm) < 0.01
