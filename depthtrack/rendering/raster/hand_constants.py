"""Constants of a hand for the rasteriser's kernels: rows of eight lanes, one finger a lane.

A primitive's slot is its group's first slot plus its lane. There are four groups of spheres (base joint to fingertip)
and three of cones (one a phalanx). The last group is general: palm cylinder, its two caps, the thumb's ellipsoid, and
two discs that only bound the cylinder's ends. All sizes come from the matrices of `hand.primitives`, which alone
define the model.
"""

import numpy as np

from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import FINGERS
from depthtrack.hand.primitives import SPHERE, Primitives
from depthtrack.hand.shape import HandShape
from depthtrack.types import Array, Index

LANES = 8
SPHERES, CONES, GENERAL, SLOTS = 0, 32, 56, 64
"""First slot of each group, and the number of slots."""

# Rows of the constants, eight lanes each.
BASE_ROTATION, BASE_POSITION, LENGTH, MIRROR = 0, 9, 12, 15
SPHERE_RADIUS, TIP_LENGTH, CONE_RADIUS, CONE_SLOPE, CONE_LENGTH = 16, 20, 21, 24, 27
GENERAL_CENTRE, GENERAL_INVERSE, GENERAL_SQUARE, GENERAL_LENGTH = 30, 33, 36, 39
IS_THUMB, BOUNDING_RADIUS, ROWS = 40, 41, 42

ACTIVE: Index = np.array(
    [GENERAL + k for k in range(4)]
    + [SPHERES + LANES * k + f for k in range(4) for f in range(5) if (k, f) != (0, 0)]
    + [CONES + LANES * k + f for k in range(3) for f in range(5) if (k, f) != (0, 0)]
)
"""The 37 slots that are drawn. The thumb's first phalanx is an ellipsoid."""


def hand_constants(shape: HandShape) -> Array:
    """Return the pose-independent constants (ROWS * 8,) of a hand, float64, metres, palm frame."""
    model, primitives = HandModel(shape), Primitives.of(shape)
    matrix = dict(zip(primitives.names, primitives.T_body_unit, strict=True))
    rows = np.zeros((ROWS, LANES))
    rows[BASE_ROTATION : BASE_ROTATION + 9, :5] = model.base_transforms[:, :3, :3].reshape(5, 9).T
    rows[BASE_POSITION : BASE_POSITION + 3, :5] = model.base_transforms[:, :3, 3].T
    rows[LENGTH : LENGTH + 3, :5] = model.lengths.T
    rows[MIRROR] = shape.mirror
    for lane, finger in enumerate(FINGERS):
        for k in range(4):
            if (sphere := matrix.get(f"{finger}_sphere_{k}")) is not None:
                rows[SPHERE_RADIUS + k, lane] = sphere[0, 0]
            if (cone := matrix.get(f"{finger}_cone_{k}")) is not None:
                _read_cone(rows, k, lane, cone)
        rows[TIP_LENGTH, lane] = matrix[f"{finger}_sphere_3"][1, 3]
    _read_general(rows, matrix)
    rows[BOUNDING_RADIUS] = _bounding_radius(model, primitives)
    return rows.ravel()


def _read_cone(rows: Array, k: int, lane: int, T: Array) -> None:
    taper = T[3, 2]  # start radius / end radius - 1: see primitives.cone
    length, radius = T[1, 2] / (1 + taper), abs(T[0, 0])
    rows[CONE_RADIUS + k, lane] = radius
    rows[CONE_LENGTH + k, lane] = length
    rows[CONE_SLOPE + k, lane] = (radius - radius / (1 + taper)) / length


def _read_general(rows: Array, matrix: dict[str, Array]) -> None:
    cylinder = matrix["palm_cylinder"]
    start, length = cylinder[:3, 3], cylinder[1, 2]
    cross_section = np.array([abs(cylinder[0, 0]), 0.0, abs(cylinder[2, 1])])
    parts = [(start, cross_section)]
    ellipsoids = (matrix[name] for name in ("palm_wrist_cap", "palm_knuckle_cap", "thumb_ellipsoid"))
    parts += [(T[:3, 3], np.abs(np.diag(T)[:3])) for T in ellipsoids]
    parts += [(start, cross_section), (start + np.array([0, length, 0]), cross_section)]
    for lane, (centre, radii) in enumerate(parts):
        rows[GENERAL_CENTRE : GENERAL_CENTRE + 3, lane] = centre
        # A radius of 0 marks an unbounded direction, which drops out of the quadric.
        rows[GENERAL_INVERSE : GENERAL_INVERSE + 3, lane] = np.divide(1, radii, out=np.zeros(3), where=radii > 0)
        rows[GENERAL_SQUARE : GENERAL_SQUARE + 3, lane] = radii**2
    rows[GENERAL_LENGTH, 0] = length
    rows[IS_THUMB, 3] = 1


def _bounding_radius(model: HandModel, primitives: Primitives) -> float:
    """Return the radius, metres, of a ball about the palm's centre that holds every pose."""
    fingers = np.linalg.norm(model.base_transforms[:, :3, 3], axis=1) + model.lengths.sum(axis=1)
    # Cylinders and cones lie within the spheres and ellipsoids at their ends.
    T = primitives.T_body_unit[primitives.kinds == SPHERE]
    parts = np.linalg.norm(T[:, :3, 3], axis=1) + np.abs(T[:, :3, :3]).max(axis=(1, 2))
    return float(fingers.max() + parts.max())
