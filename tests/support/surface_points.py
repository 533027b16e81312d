"""Posed points of a surface, in the order of its points."""

from typing import NamedTuple

import numpy as np

from depthtrack.hand.compiled_kinematics import BodyPoses
from depthtrack.solver.surface_points import PointBlocks, SurfacePoints, pose_blocks


class Posed(NamedTuple):
    """Points of a posed hand.

    x, n: (V, 3) metres, and outward unit normals, camera frame.
    """

    x: np.ndarray
    n: np.ndarray


def posed_points(points: SurfacePoints, bodies: BodyPoses) -> Posed:
    """Return the posed points of a surface by the kernel of its blocks."""
    blocks = PointBlocks.of(points)
    out, posed = np.empty_like(blocks.rest), np.full((len(points.rest), 6), np.nan)
    pose_blocks(blocks, bodies, out)
    posed[blocks.row[blocks.row >= 0]] = out.T[blocks.row >= 0]
    return Posed(posed[:, :3], posed[:, 3:])
