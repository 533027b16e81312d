"""Surface nets give closed, outward surfaces that lie on their implicit solid."""

import numpy as np
import pytest
from trimesh import Trimesh

from depthtrack.geometry.isosurface import polygonise, surface_nets, without_ambiguous_cells
from depthtrack.types import Array


def test_a_torus_has_exact_vertices_and_its_topology() -> None:
    def torus(points: Array) -> Array:
        ring = np.hypot(points[:, 0], points[:, 1]) - 1.0
        return np.asarray(np.hypot(ring, points[:, 2]) - 0.4)

    vertices, faces = polygonise(torus, np.array([-1.6, -1.6, -0.6]), np.array([1.6, 1.6, 0.6]), 0.1)
    mesh = Trimesh(vertices, faces, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.euler_number == 0
    assert mesh.volume == pytest.approx(2 * np.pi**2 * 0.4**2, rel=0.02)
    assert np.abs(torus(vertices)).max() < 1e-4
    # Relaxation leaves no slivers: the quality of an equilateral triangle is 1, of a degenerate one 0.
    a, b, c = (np.linalg.norm(vertices[faces[:, i]] - vertices[faces[:, i - 1]], axis=-1) for i in range(3))
    assert (4 * np.sqrt(3) * mesh.area_faces / (a**2 + b**2 + c**2)).min() > 0.2


def test_noise_becomes_a_manifold() -> None:
    values = np.random.default_rng(0).normal(size=(12, 12, 12))
    for axis in range(3):
        np.moveaxis(values, axis, 0)[[0, 1, -2, -1]] = 1.0
    vertices, quads = surface_nets(without_ambiguous_cells(values))
    edges = np.concatenate([quads[:, [k, (k + 1) % 4]] for k in range(4)])
    forward = {(a, b) for a, b in edges.tolist()}
    assert len(forward) == len(edges)  # no edge is used twice in one direction,
    assert {(b, a) for a, b in forward} == forward  # and each is met once from the other side
    assert len(vertices) == len(np.unique(quads))
