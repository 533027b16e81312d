"""The wrist of a forearm that points at the camera.

The visible surface of such an arm is foreshortened, and bulges of the hand hide a part of it. Its area says little
about its breadth. The breadth across the line of sight is still measured, and a hand is broader than its wrist. The
widest place may be on the forearm, so that the wrist is also searched on the other side of it.
"""

import math

import numpy as np

from depthtrack.segmentation.forearm import Arm
from depthtrack.segmentation.grid import Grid
from depthtrack.segmentation.options import ForeshortenedWristOptions
from depthtrack.segmentation.palm import Palm
from depthtrack.segmentation.wrist import most_likely_wrist
from depthtrack.types import Array


def points_at_camera(palm: Palm, arm: Arm, options: ForeshortenedWristOptions) -> bool:
    """Return whether the forearm points almost along the line of sight, towards the camera."""
    return float(arm.direction @ palm.centre) < -options.least_cosine * float(np.linalg.norm(palm.centre))


def find_foreshortened_wrist(
    grid: Grid, palm: Palm, arm: Arm, visible_end: float, options: ForeshortenedWristOptions
) -> float | None:
    """Return the distance of the wrist from the palm's centre along the arm, metres.

    It is negative if the centre is on the forearm, and None if nothing narrows like a wrist.

    visible_end: distance from the palm's centre up to which the arm is visible, metres.
    """
    profile = breadth_across(grid, palm, arm, options)
    visible = min(int((visible_end + options.before) / options.bin_width), len(profile))
    window = (options.neighbours, options.least_behind)
    ratios = (options.narrow_ratio, options.broad_ratio, options.flare_ratio)
    # No place is expected: the ratio of the breadths decides alone.
    scores = (math.inf, 1.0, options.broadest_ratio)
    place = most_likely_wrist(profile, visible, 0.0, options.bin_width, window, ratios, scores)
    return None if math.isnan(place) else place - options.before


def breadth_across(grid: Grid, palm: Palm, arm: Arm, options: ForeshortenedWristOptions) -> Array:
    """Return the breadth (bins,) across arm and line of sight, metres.

    It is 0 where nothing is visible. The first bin begins `before` metres before the palm's centre. The breadth is that
    of a strip with the same variance, which single nodes hardly change.
    """
    reached = palm.paths.reached().ravel()
    points, areas = grid.points[reached] - palm.centre, grid.areas.ravel()[reached]
    along = points @ arm.direction
    near = np.sum(points**2, axis=1) - along**2 < options.half_breadth**2
    bins = np.floor((along + options.before) / options.bin_width).astype(np.int64)
    near &= (bins >= 0) & (bins < options.bins)
    across = np.cross(arm.direction, palm.centre)
    place = points[near] @ (across / np.linalg.norm(across))
    reach = np.arange(-options.margin_bins, options.margin_bins + 1)
    kernel = np.exp(-0.5 * (reach / options.sigma_bins) ** 2)
    total, first, second = (
        np.convolve(np.bincount(bins[near], areas[near] * place**power, options.bins), kernel, mode="same")
        for power in range(3)
    )
    seen = total > 0
    mean, square = (np.divide(moment, total, out=np.zeros_like(total), where=seen) for moment in (first, second))
    return np.sqrt(12 * np.maximum(square - mean**2, 0))
