"""The forearm: found behind a palm, and the way back along its paths."""

import numpy as np
import pytest

from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.hand.primitives import SPHERE, ellipsoid
from depthtrack.rendering.raycast import raycast
from depthtrack.segmentation.forearm import backtrack, find_arm, find_vanishing_arm
from depthtrack.segmentation.grid import Grid
from depthtrack.segmentation.options import ForearmOptions, PalmOptions
from depthtrack.segmentation.palm import geodesic_extrema, palm_near_tip
from tests.support.arms import CAMERA, WRIST, club_depth, nearest_palm


def test_a_palm_alone_has_no_arm() -> None:
    depth = raycast(
        CAMERA, np.array([SPHERE]), ellipsoid((0, 0, 0.5), (0.045, 0.09, 0.03))[None], np.array([0])
    ).depth.astype(np.float32)
    grid = Grid.over(depth, CAMERA, CAMERA.rect, (0.2, 0.95), 5)
    palm = palm_near_tip(grid, grid, next(geodesic_extrema(grid, PalmOptions())), PalmOptions())
    assert palm is not None
    assert find_arm(grid, palm, WRIST, ForearmOptions()) is None


@pytest.mark.parametrize(("slant", "nearest"), [(-0.4, 0.46), (-0.8, 0.44), (-1.0, 0.42), (-1.2, 0.42)])
def test_an_arm_that_comes_too_near_is_found_at_the_gap(slant: float, nearest: float) -> None:
    """Blind nodes that are no nearer, as in a shadow, show no arm."""
    depth, options = club_depth(slant), ForearmOptions()
    near = (depth > 0) & (depth < nearest)
    grid, palm = nearest_palm(np.where(near, np.float32(0), depth))
    everywhere = Grid.over(depth, CAMERA, CAMERA.rect, (0.2, 0.95), 5).depth > 0
    blind = everywhere & ~(grid.depth > 0)
    assert find_arm(grid, palm, WRIST, options) is None
    arm = find_vanishing_arm(grid, palm, WRIST, blind, options)
    assert arm is not None
    assert arm.direction @ [0, np.cos(slant), np.sin(slant)] > 0.9
    assert find_vanishing_arm(grid, palm, WRIST, blind & False, options) is None
    shadow = np.roll(grid.depth > palm.centre[2], 1, axis=1) & ~(grid.depth > 0)
    assert find_vanishing_arm(grid, palm, WRIST, shadow, options) is None


def test_backtracking_stops_at_the_given_distance() -> None:
    grid = Grid.over(
        np.full((48, 64), 0.5, np.float32), Camera(64, 48, 60, 60, 31.5, 23.5), Rect(0, 0, 64, 48), (0.3, 0.9), 4
    )
    paths = grid.paths([0], limit=3.0)
    nodes = np.arange(grid.depth.size)
    out = np.empty_like(nodes)
    backtrack(paths.distance, paths.parent, nodes, 0.1, out)
    for node, stop in zip(nodes, out, strict=True):
        way = paths.trace(int(node))
        expected = next(step for step in way if paths.distance.flat[step] <= 0.1)
        assert stop == expected
