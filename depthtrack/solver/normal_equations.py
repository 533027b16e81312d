"""The normal equations of the hand, accumulated in a 6 x 6 matrix for each body.

While correspondences are fixed, a body's residuals are a quadratic function of its motion. That function is all that
the solver needs: its iterations cost the same for ten correspondences and for ten thousand.

A body's motion since the correspondences were found is a twist (v, w): v (m) is the motion of the point `centre` with
the body, w (rad) its turn. A residual n . (x - y) of a surface point x with direction n grows by
n . v + ((x - centre) x n) . w.
"""

from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.hand.compiled_kinematics import BODY_COUNT, BodyPoses
from depthtrack.solver.fixed_points import FixedPoints, accumulate, squared_residuals
from depthtrack.types import Array

ROW = 8
"""Elements of a row of the sums: six of a a^T, one of a e, and one of padding."""


class NormalEquations(NamedTuple):
    """Sums over the residuals e of found correspondences.

    The gradient a (6,) of a residual is by the twist of its body.

    sums: (16, 6, ROW) in each row of a body, six elements of a a^T and one of a e.
    e: (16,) sums of e^2, m^2.
    T: (16, 3, 4) T_camera_body at the search for correspondences.
    centre: (3,) reference point of twists, metres, camera frame.
    """

    sums: Array
    e: Array
    T: Array
    centre: Array

    @staticmethod
    def empty() -> "NormalEquations":
        """Return the equations of no residuals."""
        n = BODY_COUNT
        return NormalEquations(np.zeros((n, 6, ROW)), np.zeros(n), np.zeros((n, 3, 4)), np.zeros(3))


@compiled(nogil=True)
def clear(equations: NormalEquations, bodies: BodyPoses) -> None:
    """Remove all residuals, and refer those to come to the bodies where they are now."""
    equations.sums[:] = 0.0
    equations.e[:] = 0.0
    for b in range(BODY_COUNT):
        for i in range(3):
            for j in range(4):
                equations.T[b, i, j] = bodies.T[b, i, j]
    for i in range(3):
        equations.centre[i] = bodies.T[0, i, 3]


@compiled(nogil=True)
def twist(equations: NormalEquations, bodies: BodyPoses, b: int, out: Array) -> None:
    """Write the twist of body b since the residuals were added to `out` (6,).

    It is exact to first order in the rotation.
    """
    now, was, c = bodies.T[b], equations.T[b], equations.centre
    R = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            R[i, j] = now[i, 0] * was[j, 0] + now[i, 1] * was[j, 1] + now[i, 2] * was[j, 2]
    for i in range(3):
        moved = now[i, 3]
        for j in range(3):
            moved += R[i, j] * (c[j] - was[j, 3])
        out[i] = moved - c[i]
    out[3], out[4], out[5] = (R[2, 1] - R[1, 2]) / 2, (R[0, 2] - R[2, 0]) / 2, (R[1, 0] - R[0, 1]) / 2


@compiled(nogil=True)
def energy(equations: NormalEquations, points: FixedPoints, bodies: BodyPoses) -> float:
    """Return half the weighted sum of squared residuals, m^2, for the current bodies."""
    total, s = 0.0, np.empty(6)
    for b in range(equations.e.shape[0]):
        twist(equations, bodies, b, s)
        total += equations.e[b]
        for j in range(6):
            row = equations.sums[b, j]
            Ms = row[0] * s[0] + row[1] * s[1] + row[2] * s[2] + row[3] * s[3] + row[4] * s[4] + row[5] * s[5]
            total += s[j] * (2 * row[6] + Ms)
    return 0.5 * (total + squared_residuals(points, bodies))


@compiled(nogil=True)
def normal_equations(
    equations: NormalEquations, points: FixedPoints, bodies: BodyPoses, H: Array, gradient: Array
) -> float:
    """Write the normal equations for the current bodies; return the energy, m^2.

    H: (26, 26) receives J^T J.
    gradient: (26,) receives J^T e.

    A joint moves all bodies beyond it by the same twist, so sums are accumulated from the fingertips to the palm. Each
    joint uses them once: Featherstone's composite-rigid-body algorithm ("Rigid Body Dynamics Algorithms", 2008).
    """
    total = 0.0
    n = equations.e.shape[0]
    M, g, s = np.zeros((n, 6, 6)), np.zeros((n, 6)), np.empty(6)
    for b in range(n):
        twist(equations, bodies, b, s)
        total += equations.e[b]
        for j in range(6):
            Ms = 0.0
            for k in range(6):
                M[b, j, k] = equations.sums[b, j, k]
                Ms += M[b, j, k] * s[k]
            total += s[j] * (2 * equations.sums[b, j, 6] + Ms)
            g[b, j] = equations.sums[b, j, 6] + Ms
        _shift(M[b], g[b], s[0], s[1], s[2])
    total += accumulate(points, bodies, equations.centre, M, g)
    for i in range(26):
        for j in range(26):
            H[i, j] = 0.0
    c, palm = equations.centre, bodies.T[0]
    columns, F = np.zeros((26, 6)), np.empty(6)
    for j in range(3):
        columns[j, j] = 1.0
        columns[3 + j, 3 + j] = 1.0
    # A turn about the palm moves the centre too.
    px, py, pz = c[0] - palm[0, 3], c[1] - palm[1, 3], c[2] - palm[2, 3]
    columns[3, 1], columns[3, 2] = -pz, py
    columns[4, 0], columns[4, 2] = pz, -px
    columns[5, 0], columns[5, 1] = -py, px
    for finger in range(5):
        for phalanx in range(2, -1, -1):
            b = 1 + 3 * finger + phalanx
            first = 4 * finger + (1 + phalanx if phalanx > 0 else 0)
            for a in range(4 * finger + 1 + phalanx, first - 1, -1):
                _hinge(bodies, a, c, columns[6 + a])
                _apply(M[b], columns[6 + a], F)
                gradient[6 + a] = _dot(columns[6 + a], g[b])
                for j in range(6):
                    H[6 + a, j] = _dot(columns[j], F)
                # The joints further out have entered their elements already.
                for inner in range(4 * finger, a + 1):
                    _hinge(bodies, inner, c, columns[6 + inner])
                    H[6 + a, 6 + inner] = _dot(columns[6 + inner], F)
            parent = b - 1 if phalanx > 0 else 0
            for i in range(6):
                g[parent, i] += g[b, i]
                for j in range(6):
                    M[parent, i, j] += M[b, i, j]
    for i in range(6):
        _apply(M[0], columns[i], F)
        gradient[i] = _dot(columns[i], g[0])
        for j in range(i + 1):
            H[i, j] = _dot(columns[j], F)
    for i in range(26):
        for j in range(i):
            H[j, i] = H[i, j]
    return 0.5 * total


@compiled(nogil=True)
def _shift(M: Array, g: Array, dx: float, dy: float, dz: float) -> None:
    """Move the reference point of the sums of a body to the centre.

    d: (dx, dy, dz) reference point relative to the centre. The velocity there is v + w x d.
    """
    for i in range(6):
        x, y, z = M[i, 0], M[i, 1], M[i, 2]
        M[i, 3] += dy * z - dz * y
        M[i, 4] += dz * x - dx * z
        M[i, 5] += dx * y - dy * x
    for i in range(6):
        x, y, z = M[0, i], M[1, i], M[2, i]
        M[3, i] += dy * z - dz * y
        M[4, i] += dz * x - dx * z
        M[5, i] += dx * y - dy * x
    x, y, z = g[0], g[1], g[2]
    g[3] += dy * z - dz * y
    g[4] += dz * x - dx * z
    g[5] += dx * y - dy * x


@compiled(nogil=True)
def _hinge(bodies: BodyPoses, a: int, c: Array, out: Array) -> None:
    """Write the twist (6,) at the centre `c` of a unit turn of angle a to `out`."""
    ux, uy, uz = bodies.axes[a, 0], bodies.axes[a, 1], bodies.axes[a, 2]
    px, py, pz = c[0] - bodies.origins[a, 0], c[1] - bodies.origins[a, 1], c[2] - bodies.origins[a, 2]
    out[0], out[1], out[2] = uy * pz - uz * py, uz * px - ux * pz, ux * py - uy * px
    out[3], out[4], out[5] = ux, uy, uz


@compiled(nogil=True)
def _apply(M: Array, s: Array, out: Array) -> None:
    for i in range(6):
        out[i] = M[i, 0] * s[0] + M[i, 1] * s[1] + M[i, 2] * s[2] + M[i, 3] * s[3] + M[i, 4] * s[4] + M[i, 5] * s[5]


@compiled(nogil=True)
def _dot(a: Array, b: Array) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]
