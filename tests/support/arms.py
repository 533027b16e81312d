"""Grids with a palm and an arm, for the tests of forearm and wrist."""

import numpy as np

from depthtrack.geometry.camera import Camera
from depthtrack.hand.primitives import CYLINDER, SPHERE, cone, ellipsoid
from depthtrack.rendering.raycast import raycast
from depthtrack.segmentation.grid import Grid
from depthtrack.segmentation.options import PalmOptions
from depthtrack.segmentation.palm import Palm, find_palms

CAMERA = Camera(640, 480, 525.0, 525.0, 319.5, 239.5)
WRIST = 0.055
"""Distance from the palm's centre to where the tube becomes visible, metres."""


def nearest_palm(depth: np.ndarray) -> tuple[Grid, Palm]:
    """Return the grid of a depth image (h, w), metres, and its palm nearest to (0, 0, 0.5)."""
    grid = Grid.over(depth, CAMERA, CAMERA.rect, (0.2, 0.95), 5)
    # The other end of the tube is free too, and about as broad.
    palms = find_palms(grid, grid, PalmOptions())
    return grid, min(palms, key=lambda palm: float(np.linalg.norm(palm.centre - [0, 0, 0.5])))


def club(slant: float) -> tuple[Grid, Palm]:
    """Return the grid and palm of a flat palm, 90 mm across, on a tube 60 mm thick.

    The tube points down and, by `slant` radians, away from the camera.
    """
    return nearest_palm(club_depth(slant))


def club_depth(slant: float) -> np.ndarray:
    """Return the depth image (h, w) of the club, metres."""
    c, s = np.cos(slant), np.sin(slant)
    turn = np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0.5], [0, 0, 0, 1.0]])
    palm = ellipsoid((0.0, -0.01, 0.0), (0.045, 0.055, 0.030))
    fingertip = ellipsoid((0.0, -0.07, 0.0), (0.012, 0.05, 0.012))
    tube = cone((0.0, 0.0, 0.0), 0.4, 0.030, 0.032)
    placed = np.stack([turn @ part for part in (palm, fingertip, tube)])
    return raycast(CAMERA, np.array([SPHERE, SPHERE, CYLINDER]), placed, np.arange(3)).depth.astype(np.float32)
