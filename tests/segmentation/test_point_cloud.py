"""Point clouds against pixels, exact surfaces and a least-squares fit."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.geometry.camera import Camera
from depthtrack.hand.primitives import SPHERE, ellipsoid
from depthtrack.rendering.raycast import raycast
from depthtrack.segmentation.options import PointCloudOptions
from depthtrack.segmentation.point_cloud import point_cloud

SPACING, SAME_SURFACE = PointCloudOptions().sample_spacing, PointCloudOptions().same_surface
CAMERA = Camera(60, 50, 300.0, 310.0, 28.0, 26.0)


def slow_normal(camera: Camera, depth: np.ndarray, v: int, u: int) -> np.ndarray:
    """Return the normal (3,) of the same fit by numpy's least squares."""
    samples = []
    for j in (-SPACING, 0, SPACING):
        for i in (-SPACING, 0, SPACING):
            inside = 0 <= v + j < camera.height and 0 <= u + i < camera.width
            if (
                inside
                and depth[v + j, u + i] > 0
                and abs(float(depth[v + j, u + i]) - float(depth[v, u])) <= SAME_SURFACE
            ):
                samples.append((i, j, 1 / float(depth[v + j, u + i])))
    ray = np.array([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0])
    normal = ray
    design = np.array([(1, i, j) for i, j, _ in samples], dtype=float)
    if len(samples) >= 4 and np.linalg.matrix_rank(design) == 3:
        _, wu, wv = np.linalg.lstsq(design, np.array([w for _, _, w in samples]), rcond=None)[0]
        normal = np.array([wu * camera.fx, wv * camera.fy, 0])
        normal[2] = 1 / float(depth[v, u]) - ray[0] * normal[0] - ray[1] * normal[1]
    return -normal / np.linalg.norm(normal)


@given(seed=st.integers(0, 2**32 - 1))
def test_kernel_equals_the_least_squares_fit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    camera = Camera(14, 11, 60.0, 55.0, 6.0, 5.0)
    depth = (0.5 + 0.01 * rng.normal(size=camera.shape)).astype(np.float32)
    depth[rng.random(camera.shape) < 0.3] = 0
    depth[0, 0] = 0.5
    points, normals = point_cloud(camera, depth)
    rows, columns = np.nonzero(depth)
    np.testing.assert_allclose(camera.project(points), np.stack([columns, rows], axis=-1), atol=1e-9)
    np.testing.assert_allclose(points[:, 2], depth[rows, columns])
    expected = [slow_normal(camera, depth, int(v), int(u)) for v, u in zip(rows, columns, strict=True)]
    np.testing.assert_allclose(normals, expected, atol=1e-6)


def test_normals_of_a_sphere_point_away_from_its_centre() -> None:
    centre = np.array([0.005, -0.003, 0.4])
    surface = raycast(
        CAMERA, np.array([SPHERE]), ellipsoid((0.005, -0.003, 0.4), (0.025, 0.025, 0.025))[None], np.array([0])
    )
    points, normals = point_cloud(CAMERA, surface.depth.astype(np.float32))
    expected = (points - centre) / 0.025
    facing = -(expected * points).sum(axis=1) / np.linalg.norm(points, axis=1) > 0.5
    assert facing.sum() > 200
    angles = np.degrees(np.arccos(np.clip((normals * expected).sum(axis=1)[facing], -1, 1)))
    assert np.median(angles) < 1.5
    assert angles.max() < 12
    assert np.all((normals * points).sum(axis=1) < 0)


def test_normals_of_a_slanted_plane_are_exact() -> None:
    normal = np.array([0.5, -0.3, -0.8]) / np.linalg.norm([0.5, -0.3, -0.8])
    v, u = np.mgrid[: CAMERA.height, : CAMERA.width]
    rays = CAMERA.unproject(np.stack([u, v], axis=-1), np.ones(CAMERA.shape))
    depth = (normal @ [0, 0, 0.5]) / (rays @ normal)
    _, normals = point_cloud(CAMERA, depth.astype(np.float32))
    np.testing.assert_allclose(normals, np.broadcast_to(normal, normals.shape), atol=2e-3)


def test_another_surface_does_not_bend_the_normal() -> None:
    depth = np.full(CAMERA.shape, 0.5, np.float32)
    depth[:, 30:] = 0.56
    _, normals = point_cloud(CAMERA, depth)
    np.testing.assert_allclose(normals, np.broadcast_to([0.0, 0.0, -1.0], normals.shape), atol=1e-3)


def test_an_empty_map_has_no_points() -> None:
    points, normals = point_cloud(CAMERA, np.zeros(CAMERA.shape, np.float32))
    assert points.shape == normals.shape == (0, 3)


def test_a_subsampled_cloud_is_part_of_the_whole_one() -> None:
    depth = np.random.default_rng(5).uniform(0.4, 0.42, (20, 30)).astype(np.float32)
    depth[3:7, 4:9] = 0
    camera = Camera(30, 20, 500.0, 500.0, 15.0, 10.0)
    whole = point_cloud(camera, depth)
    for every in (2, 3, 7):
        for all_rows, some in zip(whole, point_cloud(camera, depth, every=every), strict=True):
            np.testing.assert_array_equal(some, all_rows[every // 2 :: every])
