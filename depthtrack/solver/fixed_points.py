"""Residual block of known correspondences: points fixed to bodies, with targets and weights.

Keypoints and optical markers are such points. Their residuals are exact in any pose; those of found correspondences
are carried along to first order (see `normal_equations`).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.compilation import compiled
from depthtrack.hand.compiled_kinematics import BODY_COUNT, BodyPoses
from depthtrack.types import Array, Index


class FixedPoints(NamedTuple):
    """Points fixed to bodies, with their measured positions.

    body: (N,) body that moves the point.
    local: (N, 3) metres, frame of that body.
    target: (N, 3) metres, camera frame.
    direction: (N, 3) unit, camera frame: the residual counts along it, or in all three coordinates if it is zero.
    weight: (N,) factor of the squared residual, 0 for a missing point.
    """

    body: Index
    local: Array
    target: Array
    direction: Array
    weight: Array

    @staticmethod
    def none() -> "FixedPoints":
        """Return an empty block."""
        return FixedPoints(np.empty(0, np.int64), np.empty((0, 3)), np.empty((0, 3)), np.empty((0, 3)), np.empty(0))

    @staticmethod
    def of(
        bodies: ArrayLike,
        local_points: ArrayLike,
        targets: ArrayLike,
        weights: ArrayLike | None = None,
        directions: ArrayLike | None = None,
    ) -> "FixedPoints":
        """Return the block of these points; a point without a finite target is missing.

        bodies: (N,).
        local_points: (N, 3) metres, body frames.
        targets: (N, 3) metres, camera frame, NaN if missing.
        weights: (N,) at least 0, 1 by default.
        directions: (N, 3) unit, all three coordinates by default.

        Raises:
            ValueError: if a body is not one of the 16, or if the arrays differ in length.
        """
        body = np.array(bodies, dtype=np.int64)
        count = len(body)
        local = np.array(local_points, dtype=np.float64).reshape(count, 3)
        target = np.array(targets, dtype=np.float64).reshape(count, 3)
        weight = np.ones(count) if weights is None else np.array(weights, dtype=np.float64).reshape(count)
        direction = np.zeros((count, 3)) if directions is None else np.array(directions, dtype=np.float64)
        if np.any((body < 0) | (body >= BODY_COUNT)):
            raise ValueError(f"bodies must be 0 to {BODY_COUNT - 1}, found {body.min()} to {body.max()}")
        missing = ~(np.isfinite(target).all(axis=1) & np.isfinite(local).all(axis=1))
        target[missing], local[missing], weight[missing] = 0.0, 0.0, 0.0
        return FixedPoints(body, local, target, direction.reshape(count, 3), weight)


@compiled(nogil=True)
def squared_residuals(points: FixedPoints, bodies: BodyPoses) -> float:
    """Return the weighted sum of squared residuals, m^2, with the bodies where they are now."""
    total = 0.0
    for i in range(points.body.shape[0]):
        if points.weight[i] == 0.0:
            continue
        ex, ey, ez = _offset(points, bodies, i)
        nx, ny, nz = points.direction[i, 0], points.direction[i, 1], points.direction[i, 2]
        if nx == 0.0 and ny == 0.0 and nz == 0.0:
            total += points.weight[i] * (ex * ex + ey * ey + ez * ez)
        else:
            e = nx * ex + ny * ey + nz * ez
            total += points.weight[i] * e * e
    return total


@compiled(nogil=True)
def accumulate(points: FixedPoints, bodies: BodyPoses, centre: Array, M: Array, g: Array) -> float:
    """Add the points to the normal equations of each body; return `squared_residuals`.

    centre: (3,) metres, camera frame, to which twists refer.
    M: (16, 6, 6) sums of a a^T.
    g: (16, 6) sums of a e.
    """
    a, total = np.empty(6), 0.0
    for i in range(points.body.shape[0]):
        if points.weight[i] == 0.0:
            continue
        ex, ey, ez = _offset(points, bodies, i)
        y, b, w = points.target[i], points.body[i], points.weight[i]
        px, py, pz = ex + y[0] - centre[0], ey + y[1] - centre[1], ez + y[2] - centre[2]
        nx, ny, nz = points.direction[i, 0], points.direction[i, 1], points.direction[i, 2]
        whole = nx == 0.0 and ny == 0.0 and nz == 0.0
        for row in range(3 if whole else 1):
            if whole:
                nx, ny, nz = 1.0 * (row == 0), 1.0 * (row == 1), 1.0 * (row == 2)
            a[0], a[1], a[2] = nx, ny, nz
            a[3], a[4], a[5] = py * nz - pz * ny, pz * nx - px * nz, px * ny - py * nx
            e = nx * ex + ny * ey + nz * ez
            total += w * e * e
            for j in range(6):
                g[b, j] += w * a[j] * e
                for k in range(6):
                    M[b, j, k] += w * a[j] * a[k]
    return total


@compiled(nogil=True)
def _offset(points: FixedPoints, bodies: BodyPoses, i: int) -> tuple[float, float, float]:
    """Return point i less its target, metres, camera frame."""
    T, x, y = bodies.T[points.body[i]], points.local[i], points.target[i]
    return (
        T[0, 0] * x[0] + T[0, 1] * x[1] + T[0, 2] * x[2] + T[0, 3] - y[0],
        T[1, 0] * x[0] + T[1, 1] * x[1] + T[1, 2] * x[2] + T[1, 3] - y[1],
        T[2, 0] * x[0] + T[2, 1] * x[1] + T[2, 2] * x[2] + T[2, 3] - y[2],
    )
