"""The expected error of layouts, against plain numpy."""

import numpy as np
import pytest

from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import make_pose
from depthtrack.hand.skin.mesh import Skin
from depthtrack.markers.layout.exchange import greedy_layout
from depthtrack.markers.layout.quality import LayoutQuality
from depthtrack.types import Array, Index


def oracle_error(quality: LayoutQuality, layout: Index) -> float:
    """Return the expected root mean square error, metres, by a dense posterior covariance."""
    candidates, options = quality.candidates, quality.options.expected
    model, skin, total = HandModel(candidates.hand), Skin.of(candidates.hand), 0.0
    C = quality.synergies.components
    spread = C @ np.diag(quality.synergies.variances) @ C.T + options.beyond**2 * np.eye(20)
    for posture in quality.postures:
        pose = make_pose(np.zeros(3), [1.0, 0, 0, 0], posture)
        prior = np.eye(26)
        prior[6:, 6:] = np.linalg.inv(spread)
        bodies = np.append(candidates.bodies[layout], 0)
        offsets = np.concatenate([candidates.offsets[layout], candidates.hand.wrist[None]])
        points = model.transform_points(pose, bodies, offsets)
        J = model.point_jacobian(pose, bodies, points).reshape(-1, 26)
        S = np.linalg.inv(prior + J.T @ J / options.residual**2)
        whole = model.point_jacobian(pose, skin.weights.argmax(axis=1), skin.at(pose))
        total += float(np.einsum("vci,ij,vcj->v", whole, S, whole).mean())
    return float(np.sqrt(total / len(quality.postures)))


def test_the_error_equals_the_trace_of_the_posterior(expected: LayoutQuality) -> None:
    rng = np.random.default_rng(0)
    for layout in rng.integers(len(expected.candidates), size=(3, 5)):
        assert expected.terms(layout).error == pytest.approx(oracle_error(expected, layout), rel=1e-6)


def test_one_more_marker_changes_the_error_as_a_whole_layout_does(expected: LayoutQuality) -> None:
    base = np.array([3, 400, 700])
    grown = expected.grown(base)
    layouts = np.column_stack([np.tile(base, (len(grown), 1)), np.arange(len(grown))])
    others = np.setdiff1d(np.arange(len(grown)), base)
    np.testing.assert_allclose(grown[others], expected.energies(layouts)[others], rtol=1e-9)
    assert np.isinf(grown[base]).all()


def test_a_bound_leaves_lower_errors_unchanged(expected: LayoutQuality) -> None:
    layouts = np.random.default_rng(1).integers(len(expected.candidates), size=(30, 5))
    energies = expected.energies(layouts)
    bounds = np.full(30, float(np.median(energies)))
    np.testing.assert_array_equal(expected.energies(layouts, bounds), np.where(energies < bounds, energies, np.inf))


def test_markers_that_no_camera_sees_are_avoided(expected: LayoutQuality) -> None:
    found = greedy_layout(expected, 4)
    hidden: Array = np.zeros(len(expected.candidates))
    hidden[found.rows] = 1.0
    unseen = expected.with_occlusion(hidden)
    assert unseen.terms(found.rows).error > 3 * expected.terms(found.rows).error
    assert unseen.terms(found.rows).occlusion == 1.0
    assert not set(greedy_layout(unseen, 4).rows) & set(found.rows)
