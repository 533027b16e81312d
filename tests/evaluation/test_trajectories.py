"""Scores of trajectories without names."""

import json
from pathlib import Path

import numpy as np
import pytest

from depthtrack.cli import main
from depthtrack.evaluation.metrics.trajectories import trajectory_score
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.formats.registry import write_capture
from depthtrack.types import Array


def labelled(frames: int = 40) -> Array:
    true = np.random.default_rng(0).normal(0, 0.2, (frames, 3, 3))
    true[10:20, 1] = np.nan
    return true


def test_the_truth_itself_is_pure() -> None:
    true = labelled()
    score = trajectory_score(true[:, [2, 0, 1]], true)
    assert (score.recall, score.purity, score.switches, score.mixed) == (1, 1, 0, 0)
    assert (score.samples, score.trajectories, score.stretches, score.fragments) == (110, 3, 4, 1)


def test_a_swap_gives_a_switch_in_each_trajectory() -> None:
    true = labelled()
    given = true.copy()
    given[30:, [0, 2]] = given[30:, [2, 0]]
    score = trajectory_score(given, true)
    assert (score.switches, score.mixed) == (2, 2)
    assert score.purity == pytest.approx(1 - 20 / 110)


def test_fragments_and_missing_samples_are_counted() -> None:
    true = labelled()
    given = np.full((40, 6, 3), np.nan)
    given[:15, 0], given[15:35, 1] = true[:15, 0], true[15:35, 0]
    given[:, 2], given[:, 3] = true[:, 1], true[:, 2]
    given[5, 4] = 9.0
    score = trajectory_score(given, true)
    assert score.trajectories == 4
    assert score.fragments == pytest.approx(4 / 3)
    assert score.recall == pytest.approx(105 / 110)
    assert score.purity == 1


def test_nothing_in_common_has_no_scores() -> None:
    score = trajectory_score(np.full((4, 1, 3), 5.0), np.full((4, 2, 3), np.nan))
    assert (score.samples, score.recall, score.purity, score.fragments) == (0, None, None, None)


def test_the_command_compares_two_captures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    true = labelled()
    write_capture(tmp_path / "true.csv", MarkerCapture(100.0, ("a", "b", "c"), true))
    write_capture(tmp_path / "linked.csv", MarkerCapture(100.0, ("t1", "t2", "t3"), true[:, [1, 2, 0]]))
    arguments = ["evaluate", str(tmp_path / "linked.csv")]
    assert main([*arguments, "--labels", str(tmp_path / "true.csv"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["purity"] == 1
    assert main([*arguments, "--labels", str(tmp_path / "true.csv")]) == 0
    assert "purity 100.000 %, 0 switches" in capsys.readouterr().out
    assert main(arguments) == 2
    assert "give the true ones as --labels FILE" in capsys.readouterr().err
    write_capture(tmp_path / "short.csv", MarkerCapture(100.0, ("a", "b", "c"), true[1:]))
    assert main([*arguments, "--labels", str(tmp_path / "short.csv")]) == 2
    assert "must have the 40 frames" in capsys.readouterr().err
