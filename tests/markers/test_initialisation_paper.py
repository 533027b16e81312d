"""Initialisation as in Maycock et al. 2015, Sec. III-A, step by step."""

from pathlib import Path

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.geometry.rotations import rotation_matrix
from depthtrack.hand.pose import make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.shape import HandShape
from depthtrack.markers.initialisation.alignment import (
    SIGNS,
    box_scale,
    canonical_form,
    principal_alignments,
    rigid_icp,
)
from depthtrack.markers.initialisation.assignment import assign_all, assign_within
from depthtrack.markers.initialisation.clusters import euclidean_clusters
from depthtrack.markers.initialisation.initialise import initialise
from depthtrack.markers.initialisation.options import InitialisationOptions
from depthtrack.markers.initialisation.started import StartedModels, save_started
from depthtrack.markers.models.marker_model import MarkerModel

PAPER = InitialisationOptions(method="paper")
TURN = np.array([0.4, 0.5, -0.3, 0.7])


def flat_hand(scale: float = 1.0) -> MarkerModel:
    """Return a hand with three markers on the back and two on each finger."""
    hand = HandShape(scale=scale)
    offsets, bodies = [[0.02, -0.03, -0.015], [-0.02, -0.03, -0.015], [-0.005, 0.02, -0.015]], [0, 0, 0]
    for finger in range(5):
        offsets += [[0, 0.7 * hand.lengths[finger, 0], -0.01], [0, 0.8 * hand.lengths[finger, 2], -0.008]]
        bodies += [1 + 3 * finger, 3 + 3 * finger]
    return MarkerModel(
        "right",
        tuple(f"m{k}" for k in range(13)),
        np.array(bodies),
        scale * np.array(offsets),
        np.full(13, 0.004),
        hand,
    )


def test_clusters_are_separated_by_distance() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0.05, 0, 0], [0.1, 0, 0], [1.05, 0, 0]], dtype=np.float64)
    assert [c.tolist() for c in euclidean_clusters(points, 0.06)] == [[0, 2, 3], [1, 4]]
    assert len(euclidean_clusters(points, 0.04)) == 5


def test_all_signs_are_rotations() -> None:
    assert {round(float(np.linalg.det(S)), 12) for S in SIGNS} == {1.0}
    assert len({S.tobytes() for S in SIGNS}) == 4


def test_principal_axes_align_a_turned_copy() -> None:
    source = np.random.default_rng(0).normal(0, [0.05, 0.03, 0.01], (12, 3))
    R = rotation_matrix(TURN)
    target = source @ R.T + [0.3, 0.2, 0.1]
    form, goal = canonical_form(source), canonical_form(1.2 * target)
    assert box_scale(form, goal, (0.5, 2)) == pytest.approx(1.2)
    alignments = principal_alignments(form, canonical_form(target))
    assert min(np.abs(source @ A.T + t - target).max() for A, t in alignments) < 1e-12


def test_icp_corrects_a_small_error() -> None:
    source = np.random.default_rng(1).normal(0, 0.05, (12, 3))
    R = rotation_matrix([1, 0.03, 0.02, -0.03])
    found, t = rigid_icp(source, source @ R.T + 0.002, np.eye(3), np.zeros(3), 30)
    np.testing.assert_allclose(found, R, atol=1e-9)
    np.testing.assert_allclose(t, 0.002, atol=1e-9)


def test_padding_leaves_markers_or_points_over() -> None:
    cost = np.array([[5.0, 1.0], [2.0, 4.0], [9.0, 9.0]])
    assert assign_all(cost).tolist() == [1, 0, -1]
    assert assign_all(cost.T).tolist() == [1, 0]
    assert assign_within(cost, 1.5).tolist() == [1, -1, -1]


def test_flat_hand_and_body_are_found_in_their_clusters() -> None:
    right = flat_hand()
    triangle = np.array([[0, 0, 0], [0.07, 0, 0], [0, 0.05, 0], [0, 0, 0.03]])
    box = MarkerModel("box", ("a", "b", "c", "d"), np.zeros(4, np.int64), triangle, np.zeros(4))
    pose = make_pose([0.2, 0.1, 0.5], TURN, POSTURES["open"])
    points = np.concatenate([right.positions(pose), triangle @ rotation_matrix(TURN) + [1.0, 0, 0]])
    order = np.random.default_rng(3).permutation(len(points))
    started = initialise(points[order], [box, right], PAPER)
    assert [m.model.name for m in started.found] == ["box", "right"]
    assert order[started.found[1].points].tolist() == list(range(13))
    assert order[started.found[0].points].tolist() == list(range(13, 17))
    assert started.found[1].residual < 0.002


def test_larger_hand_is_scaled_by_its_box() -> None:
    pose = make_pose([0.2, 0.1, 0.5], TURN, POSTURES["open"])
    started = initialise(flat_hand(1.15).positions(pose), [flat_hand()], PAPER).found[0]
    assert started.model.hand is not None
    assert started.model.hand.scale == pytest.approx(1.15, abs=0.02)
    assert started.points.tolist() == list(range(13))


def test_points_without_position_are_not_assigned() -> None:
    points = flat_hand().positions(make_pose([0.2, 0.1, 0.5], TURN, POSTURES["open"]))
    points[4] = np.nan
    started = initialise(points, [flat_hand()], PAPER).found[0]
    assert 4 not in started.points
    assert (started.points == -1).sum() == 1


def test_no_cluster_starts_no_model() -> None:
    assert initialise(np.eye(3), [flat_hand()], PAPER).models == (None,)


def test_start_needs_a_model() -> None:
    with pytest.raises(InputError, match="needs a model"):
        initialise(np.eye(3), [])


def test_saved_start_is_read_back_equal(tmp_path: Path) -> None:
    points = flat_hand().positions(make_pose([0.2, 0.1, 0.5], TURN, POSTURES["open"]))
    started = initialise(points, [flat_hand()], PAPER)
    save_started(started, tmp_path / "start.json")
    again = StartedModels.from_json(tmp_path / "start.json")
    assert again.to_json() == started.to_json()
    np.testing.assert_allclose(again.found[0].model.positions(again.found[0].pose), points, atol=2e-3)


def test_damaged_file_is_named(tmp_path: Path) -> None:
    (tmp_path / "start.json").write_text('{"frame": 0, "models": [{"pose": [1]}]}')
    with pytest.raises(InputError, match="entry 'model' is missing"):
        StartedModels.from_json(tmp_path / "start.json")
