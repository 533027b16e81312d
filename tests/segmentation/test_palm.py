"""Palm candidates: extrema against shortest paths, sizes of palms, and areas of fingers."""

from dataclasses import replace

import numpy as np
import pytest

from depthtrack.hand.primitives import SPHERE, ellipsoid, sphere
from depthtrack.rendering.raycast import raycast
from depthtrack.segmentation.grid import Grid
from depthtrack.segmentation.options import PalmOptions
from depthtrack.segmentation.palm import find_palms, geodesic_extrema, palm_near_tip, visible_finger_area
from tests.support.arms import CAMERA, club

OPTIONS = PalmOptions()


def grid_of(*parts: np.ndarray) -> Grid:
    """Return the grid of ellipsoids half a metre before the camera."""
    T = np.eye(4)
    T[2, 3] = 0.5
    placed = np.stack([T @ part for part in parts])
    kinds, bodies = np.full(len(parts), SPHERE), np.arange(len(parts))
    depth = raycast(CAMERA, kinds, placed, bodies).depth.astype(np.float32)
    return Grid.over(depth, CAMERA, CAMERA.rect, (0.2, 0.95), 5)


def test_the_first_extremum_is_farthest_from_where_the_arm_leaves_the_image() -> None:
    grid, _ = club(0.0)
    roots = np.flatnonzero((grid.depth > 0) & grid.edge)
    tip = next(geodesic_extrema(grid, OPTIONS))
    paths = grid.paths(roots, OPTIONS.path_limit)
    assert paths.distance.flat[tip] == np.max(paths.distance[paths.reached()])
    # It is the finger.
    assert grid.points[tip, 1] < -0.08


@pytest.mark.parametrize(
    ("least", "largest", "found"), [(0.012, 0.063, True), (0.05, 0.063, False), (0.012, 0.03, False)]
)
def test_only_palms_between_the_limits_are_candidates(least: float, largest: float, found: bool) -> None:
    grid = grid_of(sphere(0.0, 0.04), ellipsoid((0.0, -0.04, 0.0), (0.009, 0.06, 0.009)))
    palms = list(find_palms(grid, grid, replace(OPTIONS, least_radius=least, largest_radius=largest)))
    assert bool(palms) == found


def test_each_palm_is_found_once() -> None:
    grid, _ = club(0.0)
    nodes = [palm.node for palm in find_palms(grid, grid, OPTIONS)]
    assert len(nodes) == len(set(nodes)) > 0
    tips = list(geodesic_extrema(grid, OPTIONS))
    alone = {palm.node for tip in tips if (palm := palm_near_tip(grid, grid, tip, OPTIONS)) is not None}
    assert set(nodes) == alone


def test_fingers_are_the_narrow_parts() -> None:
    palm_only = grid_of(ellipsoid((0.0, 0.0, 0.0), (0.042, 0.05, 0.03)))
    finger = ellipsoid((0.0, -0.07, 0.0), (0.01, 0.045, 0.01))
    with_finger = grid_of(ellipsoid((0.0, 0.0, 0.0), (0.042, 0.05, 0.03)), finger)
    areas = []
    for grid in (palm_only, with_finger):
        palm = next(find_palms(grid, grid, replace(OPTIONS, least_protrusion=0.03)))
        areas.append(visible_finger_area(grid, palm, OPTIONS))
    # The visible part of the finger is about 70 mm long and up to 20 mm broad.
    assert areas[0] < 3e-4
    assert 7e-4 < areas[1] - areas[0] < 16e-4
