"""Posed skin points and closest visible points, compared with searches over all vertices."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.hand.compiled_kinematics import BodyPoses, Chain
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import make_pose
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.mesh import Skin
from depthtrack.solver import closest_points as closest
from depthtrack.solver.correspondences import Correspondences, PointCloud
from depthtrack.solver.point_search import resolve_bodies
from depthtrack.solver.surface_points import PointBlocks, SurfacePoints, pose_blocks
from depthtrack.solver.visible_points import FAR, Cells, Visible, cells_over, sort_visible
from depthtrack.tracking.surfaces.skin import mesh_points
from depthtrack.tracking.surfaces.subsampling import subsample_evenly
from tests.support.hands import random_pose
from tests.support.surface_points import Posed, posed_points

SHAPE = HandShape()
SKIN = Skin.of(SHAPE)
MODEL = mesh_points(SKIN, 0.004)
BLOCKS = PointBlocks.of(MODEL)
ORIGIN = np.array([0.01, -0.02, 0.5])
TOLERANCE = 0.008


def posed_hand(pose: np.ndarray, model: SurfacePoints = MODEL) -> Posed:
    return posed_points(model, BodyPoses.at(Chain.of(SHAPE), pose))


def posed_blocks(pose: np.ndarray) -> tuple[np.ndarray, Posed]:
    """Return the posed points in blocks (6, P), and the same as rows, which padding has too."""
    out = np.empty_like(BLOCKS.rest)
    pose_blocks(BLOCKS, BodyPoses.at(Chain.of(SHAPE), pose), out)
    return out, Posed(out[:3].T, out[3:].T)


def unit(vectors: np.ndarray) -> np.ndarray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def cloud_near(posed: Posed, rng: np.random.Generator, count: int = 60, spread: float = 0.01) -> PointCloud:
    """Return noisy points and normals at random vertices that face the camera."""
    facing = np.flatnonzero(np.einsum("vi,vi->v", posed.x, posed.n) < 0)
    pick = rng.choice(facing, count)
    normals = unit(posed.n[pick] + rng.normal(0, 0.3, (count, 3)))
    return PointCloud(posed.x[pick] + rng.normal(0, spread, (count, 3)), normals)


@given(seed=st.integers(0, 2**32 - 1))
def test_vertices_and_normals_equal_linear_blend_skinning(seed: int) -> None:
    pose = random_pose(np.random.default_rng(seed))
    posed = posed_hand(pose)
    weights = np.zeros((len(MODEL.rest), 16))
    np.put_along_axis(weights, MODEL.bodies, MODEL.weights, axis=1)
    np.testing.assert_allclose(weights.sum(axis=1), 1, atol=1e-12)
    moved = HandModel(SHAPE).transforms(pose)[:, :3] @ SKIN.T_body_rest
    blended = np.einsum("vb,bij->vij", weights, moved)
    predicted_pose = np.einsum("vij,vj->vi", blended[:, :, :3], MODEL.rest) + blended[:, :, 3]
    np.testing.assert_allclose(posed.x, predicted_pose, atol=1e-12)
    np.testing.assert_allclose(posed.n, unit(np.einsum("vij,vj->vi", blended[:, :, :3], MODEL.normals)), atol=1e-9)


def test_four_bodies_per_vertex_suffice() -> None:
    pose = random_pose(np.random.default_rng(1))
    posed = posed_hand(pose, mesh_points(SKIN))
    assert np.abs(posed.x - SKIN.at(pose)).max() < 2e-4


def test_subsampled_points_are_apart_and_leave_no_gaps() -> None:
    points = np.random.default_rng(0).uniform(size=(400, 3))
    picked = subsample_evenly(points, 0.2)
    distance = np.linalg.norm(points[:, None] - points[picked], axis=-1)
    between = distance[picked] + np.eye(len(picked))
    assert between.min() > 0.2
    assert distance.min(axis=1).max() <= 0.2
    expected: list[int] = []
    for n, point in enumerate(points):
        if not expected or np.linalg.norm(points[expected] - point, axis=1).min() > 0.2:
            expected.append(n)
    np.testing.assert_array_equal(picked, expected)
    assert len(subsample_evenly(points, 1e-9)) == 400
    assert subsample_evenly(points[:1], 0.2).tolist() == [0]


def _seen_slowly(posed: Posed, cells: Cells) -> dict[int, list[int]]:
    """Return the visible vertices of each cell."""
    in_cell: dict[int, list[int]] = {}
    for v, (x, n) in enumerate(zip(posed.x, posed.n, strict=True)):
        column, row = ((x[:2] / x[2] - [cells.u, cells.v]) // cells.size).astype(int)
        if x @ n < 0 and 0 <= column < cells.columns and 0 <= row < cells.rows:
            in_cell.setdefault(row * cells.columns + column, []).append(v)
    nearest = {cell: posed.x[vertices, 2].min() for cell, vertices in in_cell.items()}
    return {
        cell: [v for v in vertices if posed.x[v, 2] <= nearest[cell] + TOLERANCE] for cell, vertices in in_cell.items()
    }


@given(seed=st.integers(0, 2**32 - 1))
def test_visible_vertices_are_sorted_by_cell(seed: int) -> None:
    rng = np.random.default_rng(seed)
    blocks, posed = posed_blocks(random_pose(rng))
    cells = cells_over(cloud_near(posed, rng).points, 0.006, 0.01)
    seen = sort_visible(blocks, cells, ORIGIN, TOLERANCE)
    predicted_pose = _seen_slowly(posed, cells)
    assert seen.first[-1] == len(seen.vertex) == sum(map(len, predicted_pose.values()))
    for cell in range(cells.rows * cells.columns):
        assert seen.vertex[seen.first[cell] : seen.first[cell + 1]].tolist() == predicted_pose.get(cell, [])
    np.testing.assert_array_equal(seen.points, np.column_stack([posed.x, posed.n])[seen.vertex])
    there = seen.table[:, : len(seen.vertex)]
    np.testing.assert_allclose(there[:3].T + seen.origin, posed.x[seen.vertex], atol=1e-7)
    np.testing.assert_allclose(there[3:].T, posed.n[seen.vertex], atol=1e-6)
    assert np.all(seen.table[:, len(seen.vertex) :] == FAR)


def test_vertices_behind_another_finger_are_not_visible() -> None:
    """The outer fingers of a flat hand hide the middle finger from the side."""
    flat = make_pose([0, 0, 0.5], [np.sqrt(0.5), 0, np.sqrt(0.5), 0], np.zeros(20))
    blocks, posed = posed_blocks(flat)
    cells = cells_over(posed.x, 0.004, 0.01)
    seen = sort_visible(blocks, cells, ORIGIN, TOLERANCE)
    facing = np.einsum("vi,vi->v", posed.x, posed.n) < 0
    middle = np.isin(BLOCKS.body, [7, 8, 9])
    assert middle[seen.vertex].sum() < 0.5 * (facing & middle).sum()
    assert len(seen.vertex) < 0.75 * facing.sum()


@given(
    seed=st.integers(0, 2**32 - 1),
    max_distance=st.sampled_from([0.005, 0.04, 1.0]),
    min_normal_cosine=st.sampled_from([-1.1, 0.3, 0.9]),
    cell=st.sampled_from([1e-4, 0.002, 0.004, 0.02]),
)
def test_correspondences_are_the_closest_visible_vertices_with_agreeing_normals(
    seed: int, max_distance: float, min_normal_cosine: float, cell: float
) -> None:
    rng = np.random.default_rng(seed)
    blocks, posed = posed_blocks(random_pose(rng))
    cloud = cloud_near(posed, rng, spread=min(0.5 * max_distance, 0.02))
    cells = cells_over(cloud.points, cell, max_distance)
    seen, correspondences = sort_visible(blocks, cells, ORIGIN, TOLERANCE), Correspondences.allocate(len(cloud.points))
    *arranged, groups = closest.grouped(cloud.points, cloud.normals, cells, ORIGIN)
    rows = np.lexsort(cloud.points.T), np.lexsort(arranged[0].T)
    np.testing.assert_array_equal(arranged[0][rows[1]], cloud.points[rows[0]])
    np.testing.assert_array_equal(arranged[1][rows[1]], cloud.normals[rows[0]])
    cloud = PointCloud(*arranged)
    closest.closest_vertices(cloud, groups, seen, cells, max_distance, min_normal_cosine, correspondences.body)
    found, vertex = correspondences.body >= 0, seen.vertex[correspondences.body]
    resolve_bodies(BLOCKS, seen, correspondences)
    np.testing.assert_array_equal(correspondences.body >= 0, found)
    np.testing.assert_array_equal(correspondences.body[found], BLOCKS.body[vertex[found]])
    np.testing.assert_array_equal(correspondences.x[found], posed.x[vertex[found]])
    np.testing.assert_array_equal(correspondences.n[found], posed.n[vertex[found]])

    distance = np.linalg.norm(cloud.points[:, None] - posed.x[seen.vertex], axis=-1)
    same = cloud.normals @ posed.n[seen.vertex].T
    # In single precision, equal distances and limiting normals may compare either way.
    least, most = (np.where(same < min_normal_cosine + slack, np.inf, distance).min(axis=1) for slack in (-1e-6, 1e-6))
    np.testing.assert_array_equal(found[least == most], (least < max_distance)[least == most])
    at = _index(seen, vertex)
    chosen = np.where(found, distance[np.arange(len(found)), at], max_distance)
    assert np.all(chosen >= np.minimum(least, max_distance) - 1e-6)
    assert np.all(chosen <= np.minimum(most, max_distance) + 1e-6)
    assert np.all(same[found, at[found]] >= min_normal_cosine - 1e-6)


def _index(seen: Visible, vertex: np.ndarray) -> np.ndarray:
    """Return the places of vertices among the visible ones, arbitrary for the others."""
    return np.asarray(np.argmax(seen.vertex == vertex[:, None], axis=1))


@pytest.mark.parametrize(
    ("depth", "size", "around", "side"),
    [
        *((depth, 0.004, 0.04, pytest.approx(0.004)) for depth in (0.2, 0.5, 2.5)),
        (0.5, 1e-4, 0.04, pytest.approx(0.28 / 511, rel=0.1)),
        (0.5, 0.004, 100.0, pytest.approx(200.2 / 511, rel=0.1)),
    ],
)
def test_cells_cover_the_cloud_and_its_surroundings(depth: float, size: float, around: float, side: float) -> None:
    points = np.random.default_rng(0).uniform([-0.1, -0.1, depth], [0.1, 0.1, depth + 0.05], (50, 3))
    cells = cells_over(points, size, around)
    uv = points[:, :2] / points[:, 2:]
    margin = around / points[:, 2].mean()
    assert np.all(uv.min(axis=0) - margin >= np.array([cells.u, cells.v]) - 1e-12)
    assert np.all(
        uv.max(axis=0) + margin <= np.array([cells.u, cells.v]) + cells.size * np.array([cells.columns, cells.rows])
    )
    assert max(cells.columns, cells.rows) <= 512
    assert cells.size * points[:, 2].mean() == side
