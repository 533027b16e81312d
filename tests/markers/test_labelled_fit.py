"""Poses from known labels, and labels by name."""

from dataclasses import replace

import numpy as np
import pytest

from depthtrack.hand.pose import ANGLES, POSITION
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.labelled_fit import fit_poses
from depthtrack.markers.named_labels import labels_by_name
from depthtrack.synthesis.marker_capture import MarkerSynthesis, synthesise_markers
from tests.support.markers import labelled_hands


@pytest.fixture(scope="module")
def truth() -> LabelledCapture:
    """Labels and poses of a hand with 26 markers and a rigid body, 0.5 mm noise, gaps."""
    return synthesise_markers(MarkerSynthesis(frames=40, rigid_bodies=1, seed=2)).truth


@pytest.fixture(scope="module")
def fitted(truth: LabelledCapture) -> LabelledCapture:
    return fit_poses(replace(truth, poses=tuple(np.full_like(poses, np.nan) for poses in truth.poses)))


def test_poses_are_near_the_truth_without_any_start(truth: LabelledCapture, fitted: LabelledCapture) -> None:
    for found, true, model in zip(fitted.poses, truth.poses, truth.models, strict=True):
        apart = np.linalg.norm(found[:, POSITION] - true[:, POSITION], axis=1)
        assert apart.mean() < (0.003 if model.is_rigid else 0.001)
        assert np.degrees(np.abs(found[:, ANGLES] - true[:, ANGLES]).mean()) < 3
    for k in range(2):
        assert np.nanmean(fitted.residuals(k)) < np.nanmean(truth.residuals(k)) + 1e-4


def test_a_frame_without_markers_has_a_pose_only_between_others(truth: LabelledCapture) -> None:
    columns = [each.copy() for each in truth.columns]
    columns[0][:3] = -1
    columns[0][20:23] = -1
    columns[0][20, 0] = truth.columns[0][20, 0]
    poses = fit_poses(replace(truth, columns=tuple(columns))).poses[0]
    known = np.isfinite(poses).all(axis=1)
    assert known.tolist() == [False] * 3 + [True] * 37
    before, between, after = poses[19, POSITION], poses[21, POSITION], poses[23, POSITION]
    assert np.linalg.norm(between - (before + after) / 2) < 0.002


def test_labels_are_matched_by_name(truth: LabelledCapture) -> None:
    named = truth.labelled()
    found = labels_by_name(named, truth.models)
    assert found is not None
    for k in range(2):
        np.testing.assert_array_equal(found.positions(k), truth.positions(k))
        assert np.isnan(found.poses[k]).all()
    only = labels_by_name(replace(named, labels=tuple(label.partition(":")[2] for label in named.labels)), truth.models)
    assert only is not None
    np.testing.assert_array_equal(only.columns[0], found.columns[0])


def test_a_label_of_two_models_needs_its_model() -> None:
    labelled = labelled_hands(sides=("right", "left"))
    named = labelled.labelled()
    assert labels_by_name(named, labelled.models) is not None
    shared = replace(named, labels=(named.labels[0].partition(":")[2], *named.labels[1:]))
    found = labels_by_name(shared, labelled.models)
    assert found is not None
    assert np.all(found.columns[0][:, 0] == -1)
    assert labels_by_name(named.selected(named.labels[:13]), labelled.models) is None


def test_labels_may_begin_with_the_side_of_the_hand() -> None:
    labelled = labelled_hands(sides=("right", "left"))
    named = labelled.labelled()
    short = tuple(label.replace("right:", "R-").replace("left:", "L-").replace("box:", "") for label in named.labels)
    found = labels_by_name(replace(named, labels=short), labelled.models)
    assert found is not None
    for k in range(3):
        np.testing.assert_array_equal(found.positions(k), labelled.positions(k))


def test_an_unlabelled_capture_has_no_labels_by_name(truth: LabelledCapture) -> None:
    assert labels_by_name(truth.capture, truth.models) is None
