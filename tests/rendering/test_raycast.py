"""The float64 renderers agree with closed forms, trimesh and each other."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.primitives import CYLINDER, PRIMITIVE_COUNT, SPHERE, Primitives, cone, ellipsoid
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.mesh import Skin
from depthtrack.rendering.raycast import _bounds, raycast
from depthtrack.rendering.rendered_surface import NEAR
from depthtrack.rendering.triangles import rasterise
from tests.support.hands import random_pose_in_view

CAMERA = Camera(64, 48, 60.0, 62.0, 31.0, 24.5)


def directions(camera: Camera) -> np.ndarray:
    v, u = np.mgrid[: camera.height, : camera.width]
    return np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(camera.shape)], axis=-1)


def depth_of(kind: int, T: np.ndarray) -> np.ndarray:
    return raycast(CAMERA, np.array([kind]), T[None], np.array([3])).depth


def test_the_hand_has_the_papers_37_primitives() -> None:
    names = Primitives.of(HandShape()).names
    kinds = Primitives.of(HandShape()).kinds
    assert len(names) == PRIMITIVE_COUNT
    assert sum("cone" in name for name in names) == 4 * 3 + 2
    assert sum("sphere" in name for name in names) == 4 * 4 + 3
    assert sum(kinds == CYLINDER) == 4 * 3 + 2 + 1


@given(seed=st.integers(0, 2**32 - 1))
def test_primitives_are_drawn_within_their_bounding_boxes(seed: int) -> None:
    rng, kinds = np.random.default_rng(seed), np.array([SPHERE, CYLINDER])
    T = np.tile(np.eye(4), (2, 1, 1))
    T[:, :3, :3] = rng.normal(0, 0.05, (2, 3, 3))
    T[:, :3, 3] = rng.uniform([-0.5, -0.5, -0.3], [0.5, 0.5, 0.8], (2, 3))
    regions = _bounds(CAMERA, kinds, T)
    for kind, each, region in zip(kinds, T, regions, strict=True):
        low = 0.0 if kind == CYLINDER else -1.0
        corners = np.array([(x, y, z, 1.0) for x in (-1, 1) for y in (-1, 1) for z in (low, 1)]) @ each.T
        near = corners[:, 2] < NEAR
        if near.all():
            assert tuple(region) == (0, 0, 0, 0)
        elif near.any():
            assert tuple(region) == CAMERA.rect
        else:
            assert tuple(region) == Rect.around(CAMERA.project(corners[:, :3])).clipped(CAMERA.rect)


@given(seed=st.integers(0, 2**32 - 1))
def test_sphere_depth_equals_the_closed_form(seed: int) -> None:
    rng = np.random.default_rng(seed)
    centre, radius = rng.uniform([-0.1, -0.1, 0.4], [0.1, 0.1, 0.8]), rng.uniform(0.01, 0.2)
    T = ellipsoid((centre[0], centre[1], centre[2]), (radius, radius, radius))
    d = directions(CAMERA)
    a, b, c = (d * d).sum(-1), d @ centre, centre @ centre - radius**2
    D = b * b - a * c
    expected = np.where(D >= 0, (b - np.sqrt(np.maximum(D, 0))) / a, 0)
    np.testing.assert_allclose(depth_of(SPHERE, T), expected, atol=1e-9)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25)
def test_cone_hits_lie_on_the_cone(seed: int) -> None:
    """Every hit lies on the frustum's wall, and rays without a hit stay outside it."""
    rng = np.random.default_rng(seed)
    length, r0, r1 = rng.uniform(0.05, 0.3), rng.uniform(0.01, 0.06), rng.uniform(0.01, 0.06)
    T = np.eye(4)
    T[:3, :3] = trimesh.transformations.random_rotation_matrix(rng.uniform(size=3))[:3, :3]
    T[:3, 3] = rng.uniform([-0.1, -0.1, 0.5], [0.1, 0.1, 0.7])
    depth = depth_of(CYLINDER, T @ cone((0, 0, 0), length, r0, r1))
    hits = directions(CAMERA)[depth > 0] * depth[depth > 0][:, None]
    local = (hits - T[:3, 3]) @ T[:3, :3]
    along = local[:, 1]
    assert np.all((along >= -1e-9) & (along <= length + 1e-9))
    np.testing.assert_allclose(np.hypot(local[:, 0], local[:, 2]), r0 + (r1 - r0) * along / length, atol=1e-9)
    # Missed rays: sampled densely, none enters the solid through its wall.
    missed = directions(CAMERA)[depth == 0]
    samples = (missed[:, None] * np.linspace(0.2, 1.2, 400)[:, None] - T[:3, 3]) @ T[:3, :3]
    y = samples[..., 1]
    inside = (np.hypot(samples[..., 0], samples[..., 2]) < r0 + (r1 - r0) * y / length) & (y > 0) & (y < length)
    crosses_wall = (inside[:, 1:] & ~inside[:, :-1]) & (np.minimum(y[:, 1:], y[:, :-1]) > 0.003)
    crosses_wall &= np.maximum(y[:, 1:], y[:, :-1]) < length - 0.003
    assert not crosses_wall.any()


@given(seed=st.integers(0, 2**32 - 1), scale=st.floats(0.7, 1.4))
@settings(max_examples=10)
def test_hand_depth_is_the_nearest_of_its_tessellated_primitives(seed: int, scale: float) -> None:
    """Our z-buffer of finely tessellated primitives is within the tessellation's error."""
    shape = HandShape(scale=scale)
    primitives, pose = Primitives.of(shape), random_pose_in_view(seed)
    pose[:3] = [0, 0, 0.3]
    T = primitives.transforms(HandModel(shape).transforms(pose))
    exact = raycast(CAMERA, primitives.kinds, T, primitives.bodies)
    ball = trimesh.creation.icosphere(subdivisions=4)
    tube = trimesh.creation.cylinder(radius=1, segment=[[0, 0, 0], [0, 0, 1]], sections=96, cap=False)
    surface = None
    for kind, matrix in zip(primitives.kinds, T, strict=True):
        mesh = ball if kind == SPHERE else tube
        points = np.c_[mesh.vertices, np.ones(len(mesh.vertices))] @ matrix.T
        vertices, labels = points[:, :3] / points[:, 3:], np.zeros(len(mesh.faces), np.int64)
        surface = rasterise(CAMERA, vertices, mesh.faces, vertices, labels, onto=surface)
    assert surface is not None
    both = (exact.depth > 0) & (surface.depth > 0)
    assert both.sum() > 60
    assert np.mean((exact.depth > 0) != (surface.depth > 0)) < 0.01
    assert np.median(np.abs(exact.depth - surface.depth)[both]) < 2e-4


def test_faces_of_a_solid_that_face_away_are_hidden_anyway() -> None:
    for side in ("right", "left"):
        skin, pose = Skin.of(HandShape(side=side)), random_pose_in_view(8)
        pose[:3] = [0, 0, 0.3]
        mesh = skin.at(pose), skin.faces, skin.normals(skin.at(pose)), skin.face_bodies
        both_sides, front = rasterise(CAMERA, *mesh), rasterise(CAMERA, *mesh, closed=True)
        assert (both_sides.depth > 0).sum() > 60
        np.testing.assert_allclose(front.depth, both_sides.depth, atol=1e-6)
        assert np.mean(front.label != both_sides.label) < 0.002
        np.testing.assert_allclose(front.normal, both_sides.normal, atol=1e-6)


def test_normals_are_unit_and_face_the_camera() -> None:
    shape = HandShape()
    primitives = Primitives.of(shape)
    surface = raycast(
        CAMERA,
        primitives.kinds,
        primitives.transforms(HandModel(shape).transforms(random_pose_in_view(3))),
        primitives.bodies,
    )
    seen = surface.depth > 0
    np.testing.assert_allclose(np.linalg.norm(surface.normal[seen], axis=-1), 1, atol=1e-9)
    assert np.all((surface.normal * directions(CAMERA)).sum(-1)[seen] <= 1e-9)
    assert set(np.unique(surface.label)) <= set(range(-1, 16))


@pytest.mark.parametrize("z", [-0.5, 0.0, 0.01])
def test_hands_behind_around_and_at_the_camera_are_defined(z: float) -> None:
    shape, pose = HandShape(), random_pose_in_view(5)
    pose[:3] = [0, 0, z]
    primitives = Primitives.of(shape)
    depth = raycast(
        CAMERA, primitives.kinds, primitives.transforms(HandModel(shape).transforms(pose)), primitives.bodies
    ).depth
    assert np.all(np.isfinite(depth))
    assert np.all((depth == 0) | (depth >= NEAR))
    assert (depth > 0).any() == (z > -0.3)


def test_a_primitive_around_the_optical_centre_is_invisible() -> None:
    assert not depth_of(SPHERE, ellipsoid((0, 0, 0), (0.3, 0.3, 0.3))).any()
    assert depth_of(SPHERE, ellipsoid((0, 0, 0.4), (0.3, 0.3, 0.3))).any()


def test_drawing_onto_a_surface_keeps_the_nearer_hits() -> None:
    near, far = ellipsoid((0, 0, 0.4), (0.02, 0.02, 0.02)), ellipsoid((0, 0, 0.8), (0.2, 0.2, 0.2))
    first = raycast(CAMERA, np.array([SPHERE]), near[None], np.array([1]))
    both = raycast(CAMERA, np.array([SPHERE]), far[None], np.array([2]), onto=first)
    swapped = raycast(CAMERA, np.array([SPHERE, SPHERE]), np.stack([far, near]), np.array([2, 1]))
    np.testing.assert_array_equal(both.depth, swapped.depth)
    np.testing.assert_array_equal(both.label, swapped.label)
    assert both.label[24, 31] == 1
