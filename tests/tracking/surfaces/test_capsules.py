"""Closest points on tapered capsules, compared with searches over all capsules."""

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
from depthtrack.tracking.surfaces.capsules import Distances, PosedCapsules, RenderedHand
from tests.support.hands import random_pose

SHAPE = HandShape()
FITTED = fitted_capsules(SHAPE)
SEEDS = st.integers(0, 2**32 - 1)
EMPTY_RENDERING = RenderedHand(np.zeros((1, 1), np.float32), (1.0, 1.0, 0.0, 0.0), 0.006)
"""Rendering that hides no point."""


def random_capsules(rng: np.random.Generator, count: int) -> tuple[Capsules, PosedCapsules]:
    length, radius = rng.uniform(0.01, 0.06, count), rng.uniform(0.005, 0.012, count)
    taper = rng.uniform(-0.1, 0.1, count)
    axis = rng.normal(size=(count, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    posed = PosedCapsules(rng.normal([0, 0, 0.5], 0.03, (count, 3)), axis)
    return Capsules(np.arange(count), posed.start, axis, length, radius, taper), posed


def swept(capsule: Capsules, posed: PosedCapsules, k: int, points: np.ndarray) -> np.ndarray:
    """Return the signed distances (N,), metres, to capsule k: minima over many balls."""
    t = np.linspace(0, capsule.length[k], 2001)
    centres = posed.start[k] + t[:, None] * posed.axis[k]
    to_ball = np.linalg.norm(points[:, None] - centres, axis=-1) - (capsule.radius[k] - capsule.taper[k] * t)
    return np.asarray(to_ball.min(axis=1))


def measured(points: np.ndarray, capsule: Capsules, posed: PosedCapsules) -> Distances:
    out = Distances.allocate(len(capsule.body), len(points))
    capsules.measure(points, capsule, posed, out)
    return out


@given(seed=SEEDS)
def test_distances_equal_those_to_the_balls_of_a_capsule(seed: int) -> None:
    rng = np.random.default_rng(seed)
    capsule, posed = random_capsules(rng, 3)
    points = rng.normal([0, 0, 0.5], 0.04, (40, 3))
    found = measured(points, capsule, posed)
    signed = np.stack([swept(capsule, posed, k, points) for k in range(3)])
    np.testing.assert_allclose(found.each, np.abs(signed), atol=2e-6)
    np.testing.assert_allclose(found.least, found.each.min(axis=0), atol=0)
    np.testing.assert_array_equal(found.which, found.each.argmin(axis=0))
    for k in range(3):
        last = capsule.radius[k] - capsule.taper[k] * capsule.length[k]
        end = posed.start[k] + capsule.length[k] * posed.axis[k]
        one = np.concatenate([posed.start[k], end, [capsule.radius[k], last]])
        np.testing.assert_allclose(distance(one, points), signed[k], atol=1e-6)


@given(seed=SEEDS)
def test_surface_points_are_the_closest_points_of_the_visible_side(seed: int) -> None:
    rng = np.random.default_rng(seed)
    capsule, posed = random_capsules(rng, 1)
    points = rng.normal([0, 0, 0.47], 0.03, (30, 3))
    x, n = np.empty_like(points), np.empty_like(points)
    t = np.linspace(0, capsule.length[0], 20001)
    centres, radii = posed.start[0] + t[:, None] * posed.axis[0], capsule.radius[0] - capsule.taper[0] * t
    for i, point in enumerate(points):
        capsules.surface_point(points, i, capsule, posed, 0, x, n)
        nearest = np.argmin(np.linalg.norm(point - centres, axis=1) - radii)
        normal = (point - centres[nearest]) / np.linalg.norm(point - centres[nearest])
        sight = centres[nearest] / np.linalg.norm(centres[nearest])
        # A normal on the far side is mirrored to the near side.
        normal -= 2 * max(normal @ sight, 0) * sight
        np.testing.assert_allclose(n[i], normal, atol=2e-3)
        np.testing.assert_allclose(x[i], centres[nearest] + radii[nearest] * normal, atol=2e-5)
        assert np.linalg.norm(n[i]) == pytest.approx(1)


@given(seed=SEEDS, max_distance=st.sampled_from([0.004, 0.04]), min_normal_cosine=st.sampled_from([-1.0, 0.3, 0.8]))
def test_correspondences_are_on_the_nearest_capsule_with_an_agreeing_normal(
    seed: int, max_distance: float, min_normal_cosine: float
) -> None:
    rng = np.random.default_rng(seed)
    capsule, posed = random_capsules(rng, 5)
    normals = rng.normal([0, 0, -1], 0.5, (40, 3))
    cloud = PointCloud(
        rng.normal([0, 0, 0.48], 0.03, (40, 3)), normals / np.linalg.norm(normals, axis=1, keepdims=True)
    )
    found, correspondences = measured(cloud.points, capsule, posed), Correspondences.allocate(40)
    capsules.choose(cloud, capsule, posed, found, EMPTY_RENDERING, (max_distance, min_normal_cosine), correspondences)
    x, n = np.empty((40, 3)), np.empty((40, 3))
    for i in range(40):
        predicted_pose = -1
        for k in np.argsort(found.each[:, i]):
            capsules.surface_point(cloud.points, i, capsule, posed, int(k), x, n)
            if found.each[k, i] < max_distance and n[i] @ cloud.normals[i] >= min_normal_cosine:
                predicted_pose = int(k)
                break
        assert correspondences.body[i] == predicted_pose
        if predicted_pose >= 0:
            np.testing.assert_array_equal(correspondences.x[i], x[i])
            np.testing.assert_array_equal(correspondences.n[i], n[i])


def test_hidden_points_get_no_correspondence() -> None:
    """A point at the rear of two capsules matches the front one if the rear one is hidden."""
    one = np.ones(2)
    capsule = Capsules(np.arange(2), np.zeros((2, 3)), np.zeros((2, 3)), 0.05 * one, 0.01 * one, 0 * one)
    posed = PosedCapsules(np.array([[-0.02, 0, 0.40], [-0.02, 0, 0.43]]), np.array([[1.0, 0, 0], [1, 0, 0]]))
    cloud = PointCloud(np.array([[0.0, 0, 0.419]]), np.array([[0.0, 0, -1]]))
    wall = RenderedHand(np.full((3, 3), 0.39, np.float32), (1.0, 1.0, 1.0, 1.0), 0.006)
    for rendered, body in ((EMPTY_RENDERING, 1), (wall, 0)):
        correspondences = Correspondences.allocate(1)
        capsules.choose(
            cloud, capsule, posed, measured(cloud.points, capsule, posed), rendered, (0.04, 0.3), correspondences
        )
        assert correspondences.body[0] == body


def test_capsules_move_with_their_bodies_and_lie_along_the_skin() -> None:
    pose = within_limits(random_pose(np.random.default_rng(2)))
    bodies = BodyPoses.at(Chain.of(SHAPE), pose)
    posed = PosedCapsules(np.empty_like(FITTED.start), np.empty_like(FITTED.start))
    capsules.pose_capsules(FITTED, bodies, posed)
    R, p = bodies.T[FITTED.body, :, :3], bodies.T[FITTED.body, :, 3]
    np.testing.assert_allclose(posed.start, np.einsum("kij,kj->ki", R, FITTED.start) + p, atol=1e-12)
    np.testing.assert_allclose(posed.axis, np.einsum("kij,kj->ki", R, FITTED.axis), atol=1e-12)
    vertices = Skin.of(SHAPE).at(pose)
    assert np.median(measured(vertices, FITTED, posed).least) < 1e-3
