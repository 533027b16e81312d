"""Choices of a few markers of a capture, compared at the others."""

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.hand.pose import make_pose
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.layout.candidates import Candidates
from depthtrack.markers.layout.capture_comparison import HeldOutHalf, compare_choices, farthest_points
from depthtrack.markers.models.layout import load_layout
from depthtrack.types import Array


def test_few_markers_give_the_others(candidates: Candidates, postures: Array) -> None:
    model = load_layout("13", candidates.hand)
    poses = make_pose(np.zeros(3), [1.0, 0, 0, 0], np.repeat(postures, 2, axis=0))
    positions = model.positions(poses)
    columns = np.tile(np.arange(13), (len(poses), 1))
    capture = MarkerCapture(100.0, model.labels, positions)
    labelled = LabelledCapture(capture, (model,), (columns,), (poses,), (np.ones(columns.shape),))
    halves = HeldOutHalf.of(labelled, 0)
    found = compare_choices(halves, 6, draws=5, seed=0)
    assert len(set(found.ours.labels)) == 6
    assert found.random.shape == (5,)
    assert found.ours.error < 0.006
    assert found.ours.error < np.median(found.random)
    with pytest.raises(InputError, match="choose 3 to 12"):
        compare_choices(halves, 13, draws=1, seed=0)


def test_farthest_points_are_apart() -> None:
    points = np.array([[0.0, 0, 0], [0.1, 0, 0], [5, 0, 0], [0, 5, 0]])
    assert farthest_points(points, 3).tolist() == [0, 2, 3]
