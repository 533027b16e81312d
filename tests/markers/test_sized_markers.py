"""Markers on hands of any size: their positions, and their Jacobian by finite differences."""

import numpy as np
import pytest

from depthtrack.hand.compiled_kinematics import BodyPoses
from depthtrack.hand.pose import make_pose, retract
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.shape import HandShape, Side
from depthtrack.hand.size_parameters import COUNT, prior_covariance, resized
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.markers.models.sized_fit import PosturePrior, SizedFitter
from depthtrack.markers.models.sized_markers import COLUMNS, SizedMarkers, marker_jacobian, place_markers, set_sizes
from depthtrack.types import Array

STEP = 1e-6


def some_model(side: Side) -> MarkerModel:
    rng = np.random.default_rng(4)
    bodies = np.concatenate([np.zeros(3, np.int64), np.arange(1, 16)])
    offsets = rng.normal(0, 0.012, (18, 3)) + np.array([0, 0.01, -0.01])
    hand = HandShape(side=side, scale=0.93)
    return MarkerModel("hand", tuple(f"m{k}" for k in range(18)), bodies, offsets, np.full(18, 0.004), hand)


def some_pose() -> Array:
    return make_pose([0.1, -0.2, 0.4], [0.8, 0.3, -0.4, 0.2], POSTURES["grasp"])


def some_sizes() -> Array:
    return np.random.default_rng(5).multivariate_normal(np.zeros(COUNT), prior_covariance())


def placed(markers: SizedMarkers, pose: Array, sizes: Array) -> Array:
    out = np.empty((len(markers.bodies), 3))
    set_sizes(markers, sizes)
    place_markers(markers, BodyPoses.empty(), pose, out)
    return out


@pytest.mark.parametrize("side", ["right", "left"])
def test_markers_are_those_of_the_resized_hand(side: Side) -> None:
    model, pose, sizes = some_model(side), some_pose(), some_sizes()
    fitter = SizedFitter(model, 0.001, PosturePrior.from_synergies(2, 0.2))
    assert model.hand is not None
    found = placed(fitter.markers, pose, sizes)
    fitted = fitter.fitted_model(sizes)
    assert fitted.hand == resized(model.hand, sizes)
    np.testing.assert_allclose(found, fitted.positions(pose), atol=1e-12)
    np.testing.assert_allclose(placed(fitter.markers, pose, np.zeros(COUNT)), model.positions(pose), atol=1e-12)


@pytest.mark.parametrize("side", ["right", "left"])
def test_jacobian_is_that_of_finite_differences(side: Side) -> None:
    markers, pose, sizes = SizedMarkers.of(some_model(side)), some_pose(), some_sizes()
    points, bodies = placed(markers, pose, sizes), BodyPoses.empty()
    place_markers(markers, bodies, pose, points)
    J = np.empty((len(points), 3, COLUMNS))
    for i, point in enumerate(points):
        marker_jacobian(markers, bodies, i, point, sizes, J[i])
    for j in range(COLUMNS):
        step = STEP * np.eye(COLUMNS)[j]
        ahead = placed(markers, retract(pose, step[:26]), sizes + step[26:])
        behind = placed(markers, retract(pose, -step[:26]), sizes - step[26:])
        np.testing.assert_allclose(J[..., j], (ahead - behind) / (2 * STEP), atol=1e-7, err_msg=f"column {j}")


def test_fit_recovers_pose_and_overall_size() -> None:
    model, pose, sizes = some_model("right"), some_pose(), np.zeros(COUNT)
    sizes[0] = 0.12
    fitter = SizedFitter(model.with_(spread=np.full(18, 1e-4)), 1e-4, PosturePrior.from_synergies(2, 0.2), 40)
    points = fitter.fitted_model(sizes).positions(pose)
    found, start = np.zeros(COUNT), retract(pose, np.random.default_rng(1).normal(0, 0.02, 26))
    energy, predicted = fitter.fit(start, found, points, np.arange(18))
    np.testing.assert_allclose(predicted, points, atol=2e-4)
    assert found[0] == pytest.approx(0.12, abs=0.03)
    assert energy < 0.5 * sizes @ fitter.size_precision @ sizes + fitter.prior.energy(pose[7:]) + 1
