"""Closest points on tapered capsules, held to searches along their axes and through all of them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.hand.compiled_kinematics import BodyPoses, Chain
from depthtrack.hand.limits import within_limits
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.mesh import Skin
from depthtrack.solver.correspondences import Correspondences, PointCloud
from depthtrack.tracking.surfaces import capsules
from depthtrack.tracking.surfaces.capsule_fit import Capsules, distance, fitted_capsules
from depthtrack.tracking.surfaces.capsules import Distances, Placed, View
from tests.support.hands import random_pose

SHAPE = HandShape()
FITTED = fitted_capsules(SHAPE)
SEEDS = st.integers(0, 2**32 - 1)
OPEN_VIEW = View(np.zeros((1, 1), np.float32), (1.0, 1.0, 0.0, 0.0), 0.006)
"""Nothing in front of anything."""


def random_capsules(rng: np.random.Generator, count: int) -> tuple[Capsules, Placed]:
    length, radius = rng.uniform(0.01, 0.06, count), rng.uniform(0.005, 0.012, count)
    taper = rng.uniform(-0.1, 0.1, count)
    axis = rng.normal(size=(count, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    placed = Placed(rng.normal([0, 0, 0.5], 0.03, (count, 3)), axis)
    return Capsules(np.arange(count), placed.start, axis, length, radius, taper), placed


def swept(capsule: Capsules, placed: Placed, k: int, points: np.ndarray) -> np.ndarray:
    """Signed distance (N,) to the balls that sweep capsule k: the least over many of them."""
    t = np.linspace(0, capsule.length[k], 2001)
    centres = placed.start[k] + t[:, None] * placed.axis[k]
    to_ball = np.linalg.norm(points[:, None] - centres, axis=-1) - (capsule.radius[k] - capsule.taper[k] * t)
    return np.asarray(to_ball.min(axis=1))


def measured(points: np.ndarray, capsule: Capsules, placed: Placed) -> Distances:
    out = Distances.allocate(len(capsule.body), len(points))
    capsules.measure(points, capsule, placed, out)
    return out


@given(seed=SEEDS)
def test_distances_are_those_to_the_balls_that_sweep_a_capsule(seed: int) -> None:
    rng = np.random.default_rng(seed)
    capsule, placed = random_capsules(rng, 3)
    points = rng.normal([0, 0, 0.5], 0.04, (40, 3))
    found = measured(points, capsule, placed)
    signed = np.stack([swept(capsule, placed, k, points) for k in range(3)])
    np.testing.assert_allclose(found.each, np.abs(signed), atol=2e-6)
    np.testing.assert_allclose(found.least, found.each.min(axis=0), atol=0)
    np.testing.assert_array_equal(found.which, found.each.argmin(axis=0))
    for k in range(3):
        last = capsule.radius[k] - capsule.taper[k] * capsule.length[k]
        end = placed.start[k] + capsule.length[k] * placed.axis[k]
        one = np.concatenate([placed.start[k], end, [capsule.radius[k], last]])
        np.testing.assert_allclose(distance(one, points), signed[k], atol=1e-6)


@given(seed=SEEDS)
def test_surface_points_are_closest_and_on_the_side_that_is_seen(seed: int) -> None:
    rng = np.random.default_rng(seed)
    capsule, placed = random_capsules(rng, 1)
    points = rng.normal([0, 0, 0.47], 0.03, (30, 3))
    x, n = np.empty_like(points), np.empty_like(points)
    t = np.linspace(0, capsule.length[0], 20001)
    centres, radii = placed.start[0] + t[:, None] * placed.axis[0], capsule.radius[0] - capsule.taper[0] * t
    for i, point in enumerate(points):
        capsules.surface_point(points, i, capsule, placed, 0, x, n)
        nearest = np.argmin(np.linalg.norm(point - centres, axis=1) - radii)
        normal = (point - centres[nearest]) / np.linalg.norm(point - centres[nearest])
        sight = centres[nearest] / np.linalg.norm(centres[nearest])
        # On the far side, its mirror image on the near one.
        normal -= 2 * max(normal @ sight, 0) * sight
        np.testing.assert_allclose(n[i], normal, atol=2e-3)
        np.testing.assert_allclose(x[i], centres[nearest] + radii[nearest] * normal, atol=2e-5)
        assert np.linalg.norm(n[i]) == pytest.approx(1)


@given(seed=SEEDS, max_distance=st.sampled_from([0.004, 0.04]), min_normal_cosine=st.sampled_from([-1.0, 0.3, 0.8]))
def test_matches_go_to_the_nearest_capsule_that_agrees(
    seed: int, max_distance: float, min_normal_cosine: float
) -> None:
    rng = np.random.default_rng(seed)
    capsule, placed = random_capsules(rng, 5)
    normals = rng.normal([0, 0, -1], 0.5, (40, 3))
    cloud = PointCloud(
        rng.normal([0, 0, 0.48], 0.03, (40, 3)), normals / np.linalg.norm(normals, axis=1, keepdims=True)
    )
    found, correspondences = measured(cloud.points, capsule, placed), Correspondences.allocate(40)
    capsules.choose(cloud, capsule, placed, found, OPEN_VIEW, (max_distance, min_normal_cosine), correspondences)
    x, n = np.empty((40, 3)), np.empty((40, 3))
    for i in range(40):
        predicted_pose = -1
        for k in np.argsort(found.each[:, i]):
            capsules.surface_point(cloud.points, i, capsule, placed, int(k), x, n)
            if found.each[k, i] < max_distance and n[i] @ cloud.normals[i] >= min_normal_cosine:
                predicted_pose = int(k)
                break
        assert correspondences.body[i] == predicted_pose
        if predicted_pose >= 0:
            np.testing.assert_array_equal(correspondences.x[i], x[i])
            np.testing.assert_array_equal(correspondences.n[i], n[i])


def test_what_the_rendered_hand_hides_is_passed_over() -> None:
    """Two capsules across the line of sight, one behind the other: a point at the hind one goes to the fore one."""
    one = np.ones(2)
    capsule = Capsules(np.arange(2), np.zeros((2, 3)), np.zeros((2, 3)), 0.05 * one, 0.01 * one, 0 * one)
    placed = Placed(np.array([[-0.02, 0, 0.40], [-0.02, 0, 0.43]]), np.array([[1.0, 0, 0], [1, 0, 0]]))
    cloud = PointCloud(np.array([[0.0, 0, 0.419]]), np.array([[0.0, 0, -1]]))
    wall = View(np.full((3, 3), 0.39, np.float32), (1.0, 1.0, 1.0, 1.0), 0.006)
    for view, body in ((OPEN_VIEW, 1), (wall, 0)):
        correspondences = Correspondences.allocate(1)
        capsules.choose(
            cloud, capsule, placed, measured(cloud.points, capsule, placed), view, (0.04, 0.3), correspondences
        )
        assert correspondences.body[0] == body


def test_capsules_move_with_their_bodies_and_lie_along_the_skin() -> None:
    pose = within_limits(random_pose(np.random.default_rng(2)))
    bodies = BodyPoses.at(Chain.of(SHAPE), pose)
    placed = Placed(np.empty_like(FITTED.start), np.empty_like(FITTED.start))
    capsules.place_capsules(FITTED, bodies, placed)
    R, p = bodies.T[FITTED.body, :, :3], bodies.T[FITTED.body, :, 3]
    np.testing.assert_allclose(placed.start, np.einsum("kij,kj->ki", R, FITTED.start) + p, atol=1e-12)
    np.testing.assert_allclose(placed.axis, np.einsum("kij,kj->ki", R, FITTED.axis), atol=1e-12)
    vertices = Skin.of(SHAPE).at(pose)
    assert np.median(measured(vertices, FITTED, placed).least) < 1e-3
