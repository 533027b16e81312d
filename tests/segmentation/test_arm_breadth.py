"""Breadth of an arm: kernels against the definition."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.segmentation.arm_breadth import accumulate_areas, cross_section_centre
from depthtrack.segmentation.forearm import Arm
from depthtrack.segmentation.grid import Grid
from depthtrack.segmentation.options import BreadthOptions
from depthtrack.segmentation.palm import Palm

OPTIONS = BreadthOptions()
BIN, MARGIN, ARM_HALF_BREADTH = OPTIONS.bin_width, OPTIONS.margin_bins, OPTIONS.half_breadth


def _slanted_palm(seed: int) -> tuple[Grid, Palm, Arm, np.ndarray]:
    """Return a random grid, its palm, an axis, and the points (N, 3) relative to the palm."""
    rng = np.random.default_rng(seed)
    depth = np.where(rng.random((48, 64)) < 0.2, 0, 0.5 + 0.01 * rng.random((48, 64))).astype(np.float32)
    grid = Grid.over(depth, Camera(64, 48, 100, 100, 31.5, 23.5), Rect(0, 0, 64, 48), (0.3, 0.9), 2)
    node = int(rng.choice(np.flatnonzero(grid.depth)))
    palm = Palm(node, grid.points[node], 0.04, 0.1, grid.paths([node], 0.12), ())
    direction = rng.normal(size=3) * [1, 1, 0.2]
    arm = Arm(direction / np.linalg.norm(direction), np.zeros(0, np.int64))
    return grid, palm, arm, grid.points[palm.paths.reached().ravel()] - palm.centre


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25)
def test_kernels_along_the_arm_equal_the_definition(seed: int) -> None:
    grid, palm, arm, offset = _slanted_palm(seed)
    along = offset @ arm.direction
    aside = np.linalg.norm(offset - along[:, None] * arm.direction, axis=1)
    near = np.abs(along - 0.03) < 0.01
    middle = cross_section_centre(grid, palm, arm, 0.03, 0.01, OPTIONS)
    if near.any():
        assert middle is not None
        np.testing.assert_allclose(middle, palm.centre + offset[near & (aside < ARM_HALF_BREADTH)].mean(axis=0))
    else:
        assert middle is None

    total = np.zeros(OPTIONS.bins + 4 * MARGIN)
    areas = grid.areas.ravel()
    reached = palm.paths.distance.ravel()
    accumulate_areas(grid.points, areas, reached, palm.centre, arm.direction, BIN, MARGIN, ARM_HALF_BREADTH, total)
    ends, middles = (-MARGIN * BIN, (OPTIONS.bins + MARGIN) * BIN), BIN * (np.arange(total.size) - 2 * MARGIN + 0.5)
    counts = (along > ends[0]) & (along < ends[1]) & (aside < ARM_HALF_BREADTH)
    # The share of a node decreases linearly with its distance from the middle of a bin.
    shares = np.maximum(1 - np.abs(along[counts, None] - middles) / BIN, 0)
    np.testing.assert_allclose(total, areas[palm.paths.reached().ravel()][counts] @ shares, atol=1e-10)
