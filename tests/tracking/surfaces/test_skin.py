"""Points on coarse skins."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree
from trimesh.creation import icosphere

from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.mesh import Skin
from depthtrack.tracking.surfaces.skin import divided, mesh_points

BUILT = Skin.of(HandShape())


def coarse_skin() -> Skin:
    """Return an icosahedron of radius 30 mm as a skin, with edges of 32 mm."""
    ball = icosphere(subdivisions=0, radius=0.03)
    weights = np.random.default_rng(0).dirichlet(np.ones(16), len(ball.vertices))
    return replace(BUILT, rest=np.array(ball.vertices), faces=np.array(ball.faces), weights=weights)


def edges(skin: Skin) -> np.ndarray:
    corners = skin.rest[skin.faces]
    return np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)


@pytest.mark.parametrize("longest", [0.03, 0.010, 0.004])
def test_a_divided_skin_is_the_same_surface_with_short_edges(longest: float) -> None:
    coarse = coarse_skin()
    fine = divided(coarse, longest)
    assert np.median(edges(fine)) <= longest
    assert fine.to_trimesh(fine.rest).area == pytest.approx(coarse.to_trimesh(coarse.rest).area)
    assert fine.to_trimesh(fine.rest).volume == pytest.approx(coarse.to_trimesh(coarse.rest).volume)
    np.testing.assert_array_equal(fine.rest[:12], coarse.rest)
    np.testing.assert_allclose(fine.weights.sum(axis=1), 1)


def test_weights_halve_with_the_edges() -> None:
    coarse = coarse_skin()
    fine = divided(coarse, 0.02)
    ends = coarse.to_trimesh(coarse.rest).edges_unique
    nearest = cKDTree(fine.rest).query(coarse.rest[ends].mean(axis=1))[1]
    np.testing.assert_allclose(fine.weights[nearest], coarse.weights[ends].mean(axis=1))


def test_no_place_of_a_divided_skin_is_far_from_a_point() -> None:
    coarse, spacing = coarse_skin(), 0.005
    sampled = coarse.to_trimesh(coarse.rest).sample(2000, seed=1)
    far = [
        np.max(cKDTree(mesh_points(skin, spacing).rest).query(sampled)[0])
        for skin in (coarse, divided(coarse, spacing / 2))
    ]
    assert far[0] > 2 * spacing
    assert far[1] < 1.3 * spacing


def test_a_fine_skin_stays() -> None:
    assert divided(BUILT, 0.005) is BUILT
