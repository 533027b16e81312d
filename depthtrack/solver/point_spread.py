"""Spread of points of a hand whose pose has a normal distribution.

The precision of the pose is the matrix of Gauss-Newton (Schroeder et al. 2014, Eq. 4): the sum of J^T J over the
coordinates of measured points, divided by their variance, plus the precision of a prior on the angles.
"""

import math

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.hand.compiled_kinematics import BodyPoses, point_jacobian
from depthtrack.solver.linear_algebra import cholesky
from depthtrack.types import Array, Index


@compiled(nogil=True)
def point_spread(
    bodies: BodyPoses, precision: Array, deviation: float, measured: Index, at: Array, body: Index, points: Array
) -> Array:
    """Return the root mean square distances (N,) of points from the truth, metres.

    They are NaN if nothing determines the pose.

    precision: (20, 20) of the prior on the angles, 1/rad^2.
    deviation: standard deviation of a measured coordinate, metres.
    measured, at: (M,) bodies of the measured points, and their places (M, 3), metres, camera frame.
    body, points: (N,) bodies of the points, and their places (N, 3), metres, camera frame.
    """
    J, A, spread = np.zeros((3, 26)), np.zeros((26, 26)), np.full(body.shape[0], np.nan)
    for i in range(20):
        for j in range(20):
            A[6 + i, 6 + j] = precision[i, j]
    columns = np.arange(10)
    for n in range(measured.shape[0]):
        point_jacobian(bodies, measured[n], at[n], J)
        # Only the angles of its own finger move a point.
        count = 6 if measured[n] == 0 else 10
        for k in range(6, count):
            columns[k] = 4 * ((measured[n] - 1) // 3) + k
        for i in range(count):
            for j in range(i + 1):
                a, b = columns[i], columns[j]
                A[a, b] += (J[0, a] * J[0, b] + J[1, a] * J[1, b] + J[2, a] * J[2, b]) / (deviation * deviation)
    if not cholesky(A):
        return spread
    y = np.empty(26)
    for n in range(body.shape[0]):
        point_jacobian(bodies, body[n], points[n], J)
        total = 0.0
        for row in range(3):
            # J A^-1 J^T is the square of y with L y = J^T.
            for i in range(26):
                s = J[row, i]
                for k in range(i):
                    s -= A[i, k] * y[k]
                y[i] = s / A[i, i]
                total += y[i] * y[i]
        spread[n] = math.sqrt(total)
    return spread
