"""The surface grid: kernels against scipy and slow loops, geometry against shapes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components, dijkstra

from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.segmentation.grid import Grid
from depthtrack.segmentation.options import GridOptions
from depthtrack.segmentation.surface_grid import share_of_blocks

MAX_JUMP = GridOptions().max_jump
CAMERA = Camera(64, 48, 60.0, 62.0, 30.5, 25.0)
ROWS, COLUMNS = 12, 16
seeds = st.integers(0, 2**32 - 1)


def ragged_grid(seed: int) -> Grid:
    """Return a grid of a rough surface with holes and a step."""
    rng = np.random.default_rng(seed)
    depth = 0.5 + 0.01 * rng.normal(size=CAMERA.shape) + 0.05 * (rng.random() < 0.5) * (np.arange(64) > 30)
    depth[rng.random(CAMERA.shape) < 0.2] = 0
    return Grid.over(depth.astype(np.float32), CAMERA, CAMERA.rect, (0.3, 0.9), 4)


def graph_of(grid: Grid) -> coo_array:
    """Return the distances between connected neighbours, metres, as a sparse graph."""
    edges = []
    points, depth = grid.points.reshape(*grid.depth.shape, 3), grid.depth
    for i in range(depth.shape[0]):
        for j in range(depth.shape[1]):
            for k in range(max(i - 1, 0), min(i + 2, depth.shape[0])):
                for m in range(max(j - 1, 0), min(j + 2, depth.shape[1])):
                    connected = depth[i, j] > 0 and depth[k, m] > 0 and (k, m) != (i, j)
                    if connected and abs(depth[i, j] - depth[k, m]) < np.float32(MAX_JUMP):
                        length = np.linalg.norm(points[i, j] - points[k, m])
                        edges.append((i * depth.shape[1] + j, k * depth.shape[1] + m, length))
    a, b, lengths = zip(*edges, strict=True) if edges else ((), (), ())
    return coo_array((lengths, (a, b)), shape=(depth.size, depth.size))


@given(seed=seeds)
def test_blocks_hold_the_mean_of_their_nearest_surface(seed: int) -> None:
    rng = np.random.default_rng(seed)
    depth = rng.choice([0.0, 0.5, 0.51, 0.6, 2.0], CAMERA.shape).astype(np.float32)
    window, stride = Rect(5, 3, 60, 41), 3
    grid = Grid.over(depth, CAMERA, window, (0.3, 0.9), stride)
    assert grid.depth.shape == (13, 19)
    for i in range(13):
        for j in range(19):
            v, u = window.top + i * stride, window.left + j * stride
            block = depth[v : min(v + stride, window.bottom), u : min(u + stride, window.right)]
            near = block[(block >= 0.3) & (block <= 0.9)]
            expected = near[near <= near.min() + np.float32(MAX_JUMP)].mean() if 4 * near.size >= block.size else 0
            assert abs(grid.depth[i, j] - expected) < 1e-6


def test_nodes_lie_in_the_middle_of_their_blocks() -> None:
    grid = Grid.over(np.full(CAMERA.shape, 0.5, np.float32), CAMERA, Rect(8, 4, 48, 44), (0.3, 0.9), 4)
    pixels = CAMERA.project(grid.points).reshape(10, 10, 2)
    np.testing.assert_allclose(pixels[2, 3], [8 + 3 * 4 + 1.5, 4 + 2 * 4 + 1.5], atol=1e-6)
    # All blocks together cover the region.
    assert np.isclose(grid.areas.sum(), 0.5**2 * 40 * 40 / (CAMERA.fx * CAMERA.fy), rtol=1e-5)


@given(seed=seeds)
def test_surfaces_are_the_connected_components(seed: int) -> None:
    grid = ragged_grid(seed)
    labels, areas = grid.surfaces()
    _, expected = connected_components(graph_of(grid), directed=False)
    nodes = np.flatnonzero(grid.depth.ravel() > 0)
    found = labels.ravel()[nodes]
    # The partitions are equal if equal labels coincide.
    np.testing.assert_array_equal(found[:, None] == found, expected[nodes][:, None] == expected[nodes])
    assert np.all(labels[grid.depth == 0] == -1)
    for label, area in enumerate(areas):
        assert np.isclose(area, grid.areas[labels == label].sum())


@given(seed=seeds)
def test_distances_equal_dijkstra(seed: int) -> None:
    grid = ragged_grid(seed)
    rng = np.random.default_rng(seed)
    nodes = np.flatnonzero(grid.depth.ravel() > 0)
    sources = rng.choice(nodes, 3)
    expected = dijkstra(graph_of(grid), indices=sources, min_only=True).reshape(ROWS, COLUMNS)
    paths = grid.paths(sources, limit=2.0)
    np.testing.assert_allclose(paths.distance, np.where(expected <= 2.0, expected, np.inf), rtol=1e-5)
    # Sources can be added later.
    later = grid.paths(sources[:1], limit=2.0)
    grid.extend(later, sources[1:], limit=2.0)
    np.testing.assert_allclose(later.distance, paths.distance, rtol=1e-5)
    # The lengths of the steps of a path add up to its distance.
    farthest = int(np.argmax(np.where(paths.reached(), paths.distance, -1)))
    way = grid.points[paths.trace(farthest)]
    length = np.linalg.norm(np.diff(way, axis=0), axis=1).sum()
    assert np.isclose(length, paths.distance.flat[farthest], atol=1e-5)


def test_the_limit_bounds_the_paths() -> None:
    grid = Grid.over(np.full(CAMERA.shape, 0.5, np.float32), CAMERA, CAMERA.rect, (0.3, 0.9), 4)
    near, far = grid.paths([0], limit=0.1), grid.paths([0], limit=2.0)
    np.testing.assert_array_equal(near.reached(), far.reached(0.1))
    assert far.reached().all()


def test_inscribed_circles_are_metric_and_end_at_the_region() -> None:
    grid = Grid.over(
        np.full((200, 200), 0.5, np.float32),
        Camera(200, 200, 250, 250, 100, 100),
        Rect(0, 0, 200, 200),
        (0.3, 0.9),
        2,
    )
    v, u = np.mgrid[:100, :100]
    disc = (u - 40) ** 2 + (v - 50) ** 2 <= 20**2
    # A node is 2 pixels wide: 4 mm at half a metre.
    assert abs(grid.inscribed(disc).max() - 0.080) < 0.004
    assert abs(grid.inscribed(np.ones_like(disc)).max() - 0.200) < 0.006


@pytest.mark.parametrize("stride", [3, 5])
def test_shares_equal_those_of_the_selected_blocks(stride: int) -> None:
    rng = np.random.default_rng(stride)
    mask = rng.integers(0, 2, (17, 23)).astype(np.uint8)
    blocks = rng.integers(0, 2, (-(-17 // stride), -(-23 // stride))).astype(np.uint8)
    share = np.zeros(blocks.shape, np.float32)
    share_of_blocks(mask, stride, blocks, share)
    step = 1 if stride < 4 else 2
    for i in range(blocks.shape[0]):
        for j in range(blocks.shape[1]):
            block = mask[i * stride : (i + 1) * stride : step, j * stride : (j + 1) * stride : step]
            assert share[i, j] == pytest.approx(block.mean() if blocks[i, j] else 0)
