"""The compiled normal equations of a view, against plain numpy."""

from typing import get_args

import numpy as np
import pytest

from depthtrack.calibration.size_equations import (
    PARAMETERS,
    Residuals,
    SizedHand,
    add_normal_equations,
    mirror_upper,
    write_gradient,
)
from depthtrack.hand.displacement_grid import NODES
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.shape import HandShape, Side
from depthtrack.hand.size_parameters import COUNT, hand_of, motion_of, prior_covariance
from depthtrack.hand.skin.mesh import Skin
from depthtrack.solver.robust import geman_mcclure


def _posed(side: Side) -> tuple[HandModel, np.ndarray, Residuals]:
    """Return a hand of uncommon sizes in a pose, and residuals on all its bodies."""
    random = np.random.default_rng(5)
    values = 0.5 * random.standard_normal(COUNT) * np.sqrt(np.diag(prior_covariance()))
    pose = make_pose([0.02, 0, 0.5], [0.5, 0.5, -0.4, 0.6], POSTURES["relaxed"])
    model, bodies = HandModel(hand_of(values, side)), np.repeat(np.arange(16), 3)
    x = model.transform_points(pose, bodies, 0.01 * random.standard_normal((48, 3)))
    errors = 0.01 * random.standard_normal(48)
    return model, pose, Residuals(bodies, x, random.standard_normal((48, 3)), errors, np.abs(errors))


def _gradients(model: HandModel, pose: np.ndarray, residuals: Residuals) -> np.ndarray:
    """Return the gradients (N, 61) in numpy."""
    by_pose = model.point_jacobian(pose, residuals.bodies, residuals.x)
    by_sizes = motion_of(model, pose, residuals.bodies, residuals.x)
    return np.einsum("ni,nij->nj", residuals.directions, np.concatenate([by_pose, by_sizes], axis=-1))


@pytest.mark.parametrize("side", get_args(Side))
def test_gradients_are_those_of_numpy(side: Side) -> None:
    model, pose, residuals = _posed(side)
    hand, columns, a = SizedHand.at(model, pose), np.empty(24, np.int64), np.empty(24)
    found = np.zeros((len(residuals.x), PARAMETERS))
    for row, body, x, direction in zip(found, residuals.bodies, residuals.x, residuals.directions, strict=True):
        count = write_gradient(hand, body, x, direction, columns, a)
        assert (np.diff(columns[:count]) > 0).all()
        row[columns[:count]] = a[:count]
    np.testing.assert_allclose(found, _gradients(model, pose, residuals), atol=1e-14)


def test_normal_equations_are_weighted_sums_of_gradients() -> None:
    model, pose, residuals = _posed("left")
    H, g = np.zeros((PARAMETERS, PARAMETERS)), np.zeros(PARAMETERS)
    for _ in range(2):
        add_normal_equations(SizedHand.at(model, pose), residuals, 0.01, H, g)
        mirror_upper(H)
    a, weights = _gradients(model, pose, residuals), geman_mcclure(residuals.distances**2, 0.01)
    np.testing.assert_allclose(H, 2 * (a * weights[:, None]).T @ a, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(g, 2 * a.T @ (weights * residuals.errors), rtol=1e-11, atol=1e-12)


def test_displacements_are_added_by_finite_differences_of_the_skin() -> None:
    """A node's derivative is the motion of skin points along their normals."""
    side: Side = "left"
    hand, pose = HandShape(side=side, scale=0.9), make_pose([0.02, 0, 0.5], [0.5, 0.5, -0.4, 0.6], POSTURES["relaxed"])
    skin, model = Skin.of(hand.with_(displacement=np.zeros(NODES))), HandModel(hand)
    # Points that one body moves are rigid with it, so that its frame places them in every pose.
    rigid = np.flatnonzero(skin.weights.max(axis=1) > 1 - 1e-9)[::90]
    x, normals = skin.at(pose)[rigid], skin.normals(skin.at(pose))[rigid]
    bodies, errors = skin.weights[rigid].argmax(axis=1), np.linspace(-0.004, 0.004, len(rigid))
    residuals = Residuals(bodies, x, normals, errors, np.abs(errors))
    H, g = np.zeros((PARAMETERS + NODES,) * 2), np.zeros(PARAMETERS + NODES)
    add_normal_equations(SizedHand.at(model, pose), residuals, 0.01, H, g)
    mirror_upper(H)
    by_node, weights = np.zeros((len(rigid), NODES)), geman_mcclure(residuals.distances**2, 0.01)
    for node in range(NODES):
        displaced = Skin.of(hand.with_(displacement=0.001 * np.eye(NODES)[node])).at(pose)[rigid]
        by_node[:, node] = np.einsum("ni,ni->n", displaced - x, normals) / 0.001
    a = np.concatenate([_gradients(model, pose, residuals), by_node], axis=1)
    np.testing.assert_allclose(g, a.T @ (weights * errors), atol=1e-6)
    np.testing.assert_allclose(H, (a * weights[:, None]).T @ a, atol=1e-3)
