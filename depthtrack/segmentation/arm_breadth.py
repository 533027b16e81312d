"""Breadth and cross-sections of an arm along its axis."""

from functools import cache

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.segmentation.forearm import Arm
from depthtrack.segmentation.grid import Grid
from depthtrack.segmentation.options import BreadthOptions
from depthtrack.segmentation.palm import Palm
from depthtrack.types import Array, Array32


@cache
def bin_middles(options: BreadthOptions) -> Array:
    """Return the distances (bins,) of samples of the breadth from the palm's centre, metres."""
    middles = options.bin_width * (np.arange(options.bins, dtype=np.float64) + 0.5)
    middles.setflags(write=False)
    return middles


@cache
def _smoothing_kernel(options: BreadthOptions) -> Array:
    margin = options.margin_bins
    kernel = np.exp(-0.5 * (np.arange(-margin, margin + 1) / options.sigma_bins) ** 2)
    kernel /= kernel.sum()
    return np.asarray(kernel)


def breadth_profile(grid: Grid, palm: Palm, arm: Arm, options: BreadthOptions) -> Array:
    """Return the visible breadth (bins,) of an arm at the distances of `bin_middles`, metres."""
    margin = options.margin_bins
    total = np.zeros(options.bins + 4 * margin)
    reached, areas = palm.paths.distance.ravel(), grid.areas.ravel()
    width, half = options.bin_width, options.half_breadth
    accumulate_areas(grid.points, areas, reached, palm.centre, arm.direction, width, margin, half, total)
    smooth = np.convolve(total, _smoothing_kernel(options), mode="same")[2 * margin : 2 * margin + options.bins]
    # An arm that points away from the camera covers less of the image by the sine of its angle to the line of sight.
    sight = palm.centre / np.linalg.norm(palm.centre)
    sine = np.sqrt(max(1 - float(arm.direction @ sight) ** 2, 0.1))
    return np.asarray(smooth / width / sine)


@compiled()
def accumulate_areas(
    points: Array,
    areas: Array32,
    reached: Array32,
    centre: Array,
    direction: Array,
    bin_width: float,
    margin: int,
    half_breadth: float,
    total: Array,
) -> None:
    """Add the areas of nodes to bins along an axis; each node is shared by the two nearest bins.

    points: (N, 3), metres, camera frame.
    areas: (N,), m^2.
    reached: (N,) geodesic distance, metres; nodes with an infinite one are left out.
    centre, direction: (3,) origin, metres, and unit direction of the axis, camera frame.
    bin_width: metres.
    margin: bins before the origin and beyond the end that receive areas.
    half_breadth: largest distance of a node from the axis, metres.
    total: (bins + 4 margin,), m^2, added to in place; the first 2 margin bins are before the origin.
    """
    last = total.size - 3 * margin
    for n in range(reached.size):
        if not np.isfinite(reached[n]):
            continue
        x, y, z = points[n, 0] - centre[0], points[n, 1] - centre[1], points[n, 2] - centre[2]
        along = x * direction[0] + y * direction[1] + z * direction[2]
        near = -margin * bin_width < along < last * bin_width
        if near and x * x + y * y + z * z - along * along < half_breadth**2:
            place = along / bin_width - 0.5 + 2 * margin
            left = int(np.floor(place))
            share = place - left
            total[left] += areas[n] * (1 - share)
            total[left + 1] += areas[n] * share


def cross_section_centre(
    grid: Grid, palm: Palm, arm: Arm, distance: float, half_length: float, options: BreadthOptions
) -> Array | None:
    """Return the centroid (3,) of an arm's nodes at a distance from the palm, or None.

    It is in metres, camera frame.

    distance: along the arm from the palm's centre, metres.
    half_length: largest difference of a node's distance, metres.
    """
    middle = np.empty(3)
    reached, half_breadth = palm.paths.distance.ravel(), options.half_breadth
    found = section_centroid(
        grid.points, reached, palm.centre, arm.direction, distance, half_length, half_breadth, middle
    )
    return middle if found else None


@compiled()
def section_centroid(
    points: Array,
    reached: Array32,
    centre: Array,
    direction: Array,
    distance: float,
    half_length: float,
    half_breadth: float,
    middle: Array,
) -> bool:
    """Compute the centroid of points near an axis; return whether there are any.

    points, reached, centre, direction, half_breadth: as in `accumulate_areas`.
    distance, half_length: middle and half extent of the section along the axis, metres.
    middle: (3,) output, metres, camera frame.
    """
    count = 0
    middle[:] = 0.0
    for n in range(reached.size):
        if not np.isfinite(reached[n]):
            continue
        x, y, z = points[n, 0] - centre[0], points[n, 1] - centre[1], points[n, 2] - centre[2]
        along = x * direction[0] + y * direction[1] + z * direction[2]
        aside_squared = x * x + y * y + z * z - along * along
        if abs(along - distance) < half_length and aside_squared < half_breadth**2:
            count += 1
            for axis in range(3):
                middle[axis] += points[n, axis]
    for axis in range(3):
        middle[axis] /= max(count, 1)
    return count > 0
