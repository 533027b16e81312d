"""The compiled residuals between rendered skin and observation, against scipy."""

import numpy as np
import pytest
from scipy.ndimage import binary_erosion
from scipy.spatial import cKDTree

from depthtrack.calibration.outline_and_surface import SeenSkin, SeenView, outline_residuals, surface_residuals
from depthtrack.calibration.posed_mesh import PosableMesh, posed_mesh
from depthtrack.geometry.camera import Camera
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.mesh import Skin
from depthtrack.rendering.triangles import rasterise

CAMERA = Camera(160, 150, 300, 310, 60, 75)
POSE = make_pose([0.01, 0.0, 0.5], [0.1, 0.9, 0.2, 0.1], POSTURES["relaxed"])
REACH, AGREEMENT = 0.04, 0.3


@pytest.fixture(scope="module")
def seen() -> SeenSkin:
    """Part of the hand lies outside the image."""
    skin = Skin.of(HandShape())
    vertices = skin.at(POSE)
    surface = rasterise(CAMERA, vertices, skin.faces, skin.normals(vertices), skin.face_bodies)
    return SeenSkin(surface.depth, surface.label, surface.normal, (CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy))


@pytest.fixture(scope="module")
def view(seen: SeenSkin) -> SeenView:
    """Points on the skin, near it, and far from it."""
    random = np.random.default_rng(2)
    row, column = np.nonzero(seen.depth)
    pick = random.choice(len(row), 400)
    points = CAMERA.unproject(np.stack([column, row], axis=-1), seen.depth[row, column])[pick]
    points += random.standard_normal((400, 3)) * random.choice([0.0, 0.003, 0.03], (400, 1))
    normals = random.standard_normal((400, 3))
    beyond, outward = random.standard_normal(seen.depth.shape), random.standard_normal((2, *seen.depth.shape))
    outward[:, ::3] = 0.0
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return SeenView(points, normals, beyond, outward)


def _beyond_wrist(points: np.ndarray, wrist: float) -> np.ndarray:
    T = HandModel(HandShape()).transforms(POSE)[0]
    return np.asarray((points - T[:3, 3]) @ T[:3, 1] > wrist)


def test_a_posed_mesh_is_that_of_the_skin() -> None:
    skin = Skin.of(HandShape())
    T = HandModel(HandShape()).transforms(POSE)
    vertices, normals = posed_mesh(PosableMesh.of(skin), T @ skin.T_body_rest)
    np.testing.assert_allclose(vertices, skin.at(POSE), atol=1e-15)
    np.testing.assert_allclose(normals, skin.normals(skin.at(POSE)), atol=1e-9)


@pytest.mark.parametrize("wrist", [-1.0, 0.0])
def test_correspondences_are_the_nearest_visible_skin(view: SeenView, seen: SeenSkin, wrist: float) -> None:
    palm = HandModel(HandShape()).transforms(POSE)[0, :3]
    found = surface_residuals(view, seen, palm, wrist)
    row, column = np.nonzero(seen.depth)
    x = CAMERA.unproject(np.stack([column, row], axis=-1), seen.depth[row, column])
    distance, k = map(np.asarray, cKDTree(x).query(view.points, distance_upper_bound=REACH))
    kept = np.isfinite(distance) & _beyond_wrist(view.points, wrist)
    k, distance, points, normals = k[kept], distance[kept], view.points[kept], view.normals[kept]
    n = seen.normal[row, column][k]
    agree = np.sum(n * normals, axis=1) > AGREEMENT
    assert 0 < agree.sum() < len(agree) < 400
    np.testing.assert_allclose(found.distances, distance[agree], atol=1e-12)
    np.testing.assert_allclose(found.x, x[k][agree], atol=1e-12)
    np.testing.assert_array_equal(found.bodies, seen.label[row, column][k][agree])
    mean = n[agree] + normals[agree]
    mean /= np.linalg.norm(mean, axis=1, keepdims=True)
    np.testing.assert_allclose(found.directions, mean, atol=1e-12)
    np.testing.assert_allclose(found.errors, np.sum(mean * (x[k] - points)[agree], axis=1), atol=1e-12)


def test_outlines_are_the_pixels_that_erosion_removes(view: SeenView, seen: SeenSkin) -> None:
    found = outline_residuals(view, seen, HandModel(HandShape()).transforms(POSE)[0, :3], 0.0)
    visible = seen.depth > 0
    row, column = np.nonzero(visible & ~binary_erosion(visible, border_value=1))
    x = CAMERA.unproject(np.stack([column, row], axis=-1), seen.depth[row, column])
    kept = _beyond_wrist(x, 0.0) & (np.abs(view.outward[:, row, column]).sum(axis=0) > 0)
    row, column, x = row[kept], column[kept], x[kept]
    assert 0 < kept.sum() < len(kept)
    np.testing.assert_allclose(found.x, x, atol=1e-12)
    np.testing.assert_allclose(found.errors, (view.beyond[row, column] + 0.5) * x[:, 2] / CAMERA.fx, atol=1e-12)
    # A residual does not change along the line of sight.
    np.testing.assert_allclose(np.sum(found.directions * x, axis=1), 0.0, atol=1e-12)


def test_nothing_visible_gives_no_residuals(view: SeenView, seen: SeenSkin) -> None:
    nothing = SeenSkin(np.zeros_like(seen.depth), seen.label, seen.normal, seen.camera)
    palm = HandModel(HandShape()).transforms(POSE)[0, :3]
    assert len(surface_residuals(view, nothing, palm, -1.0).errors) == 0
    assert len(outline_residuals(view, nothing, palm, -1.0).errors) == 0
