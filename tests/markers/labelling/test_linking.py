"""Trajectories without models."""

from pathlib import Path

import numpy as np
import pytest

from depthtrack.cli import main
from depthtrack.errors import InputError
from depthtrack.evaluation.metrics.trajectories import trajectory_score
from depthtrack.geometry.rotations import quaternion_exp, rotation_matrix
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.formats.registry import read_capture, write_capture
from depthtrack.markers.labelling.linking import LinkingOptions, link_capture
from depthtrack.synthesis.marker_measurement import shuffle_points
from depthtrack.types import Array


def body(frames: int = 240) -> Array:
    """Return a turning rigid body (T, 8, 3) whose markers vanish for up to 0.3 s."""
    rng = np.random.default_rng(1)
    shape, angle = rng.uniform(-0.2, 0.2, (8, 3)), np.linspace(0, 2, frames)
    R = rotation_matrix(quaternion_exp(np.stack([0 * angle, 0 * angle, angle], axis=-1)))
    X = np.einsum("tij,mj->tmi", R, shape) + rng.normal(0, 0.0003, (frames, 8, 3))
    for marker in range(6):
        start = 30 + 30 * marker
        X[start : start + 5 + 5 * marker, marker] = np.nan
    return X


def stripped(X: Array) -> MarkerCapture:
    points, _ = shuffle_points(X, 4)
    return MarkerCapture(100.0, tuple(f"*{k}" for k in range(points.shape[1])), points)


def test_trajectories_are_joined_over_gaps() -> None:
    X = body()
    score = trajectory_score(link_capture(stripped(X)).positions, X)
    assert (score.trajectories, score.switches, score.recall) == (8, 0, 1.0)


def test_gaps_that_are_too_long_are_not_joined() -> None:
    X = body()
    score = trajectory_score(link_capture(stripped(X), LinkingOptions(longest_gap=0.1)).positions, X)
    assert score.switches == 0
    assert score.trajectories > 8


def test_every_point_is_in_one_trajectory() -> None:
    capture = stripped(body(60))
    linked = link_capture(capture)
    assert linked.labels == tuple(f"*{k + 1}" for k in range(len(linked.labels)))
    for t in range(60):
        assert sorted(map(tuple, linked.points(t)[0])) == sorted(map(tuple, capture.points(t)[0]))


def test_an_empty_capture_has_no_trajectories() -> None:
    assert link_capture(MarkerCapture(100.0, ("*1",), np.full((5, 1, 3), np.nan))).labels == ()


def test_the_command_writes_trajectories(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_capture(tmp_path / "points.trc", stripped(body(60)))
    assert main(["markers", "link", str(tmp_path / "points.trc"), "-o", str(tmp_path / "linked.trc")]) == 0
    assert "8 trajectories" in capsys.readouterr().out
    assert len(read_capture(tmp_path / "linked.trc").labels) == 8


def test_options_out_of_range_are_rejected() -> None:
    with pytest.raises(InputError, match="neighbours"):
        LinkingOptions(neighbours=1)
