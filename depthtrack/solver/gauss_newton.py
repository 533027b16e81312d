"""Damped Gauss-Newton on fixed correspondences (Schroeder et al. 2014, Sec. IV-A and IV-B), compiled.

The inner iterations see the observation only through its moments, so they are nearly free.
"""

from typing import NamedTuple

import numba
import numpy as np

from depthtrack.hand.compiled_kinematics import BodyPoses, Chain, forward_kinematics, retract
from depthtrack.solver.normal_equations import NormalEquations, energy, normal_equations
from depthtrack.solver.subspace import PostureSubspace
from depthtrack.types import Array

_ENOUGH = 3e-5
"""Metres or radians below which a step is the last one on these correspondences."""


class Damping(NamedTuple):
    """What holds the solution back.

    `posture` lambda of Eq. (4), m^2 / rad^2, on each finger angle or synergy; `pose` on translation (unitless) and
    rotation (m^2 / rad^2), only to keep the system solvable. `precision` (20, 20) and `mean` (20,): a pull towards
    likely postures, m^2 / rad^2. `avoid_limits`: whether damping grows towards the limits (Sec. IV-B).
    """

    posture: float
    pose: float
    precision: Array
    mean: Array
    avoid_limits: bool


class SolverState(NamedTuple):
    """Working state of one frame: `pose` (27,), `coordinates` (l,) of its angles, and `slope` (l,), |dH/dtheta| of the
    joint limit function one step before."""

    pose: Array
    coordinates: Array
    slope: Array


@numba.njit(cache=True, nogil=True)
def limit_gradient(x: float, low: float, high: float) -> float:
    """|dH/dx| for H = (high - low)^2 / ((high - x) (x - low)), the joint limit function of Sec. IV-B."""
    allocate = max((high - x) * (x - low), 1e-9)
    return (high - low) ** 2 * abs(2 * x - high - low) / (allocate * allocate)


@numba.njit(cache=True, nogil=True)
def solve(
    chain: Chain,
    equations: NormalEquations,
    space: PostureSubspace,
    damping: Damping,
    iterations: int,
    bodies: BodyPoses,
    state: SolverState,
) -> float:
    """Move `state` to lessen Eq. (3), by at most `iterations` steps; returns the final energy (m^2).

    `bodies` are left where the final pose puts them.
    """
    pose, coordinates, slope = state.pose, state.coordinates, state.slope
    count = coordinates.shape[0]
    size = 6 + count
    H, gradient = np.empty((26, 26)), np.empty(26)
    A, b, tangent = np.empty((size, size)), np.empty(size), np.empty(26)
    trial, trial_coordinates = np.empty(27), np.empty(count)
    pull = _reduced_precision(damping, space)
    forward_kinematics(chain, pose, bodies)
    for _ in range(iterations):
        current = normal_equations(equations, bodies, H, gradient)
        _reduce(H, gradient, space, A, b)
        current += _add_prior(pose, damping, space, pull, A, b)
        for i in range(3):
            A[i, i] += damping.pose
            A[3 + i, 3 + i] += damping.pose * 1e-2
        for i in range(count):
            here = limit_gradient(coordinates[i], space.lower[i], space.upper[i])
            scale = 1.0 + here if damping.avoid_limits and here >= slope[i] else 1.0
            slope[i] = here
            A[6 + i, 6 + i] += damping.posture * scale
            # At its limit and pushed beyond, a parameter takes no part.
            push = -b[6 + i]
            if (coordinates[i] <= space.lower[i] and push < 0) or (coordinates[i] >= space.upper[i] and push > 0):
                for j in range(size):
                    A[6 + i, j] = A[j, 6 + i] = 0.0
                A[6 + i, 6 + i] = 1.0
                b[6 + i] = 0.0
        if not cholesky_solve(A, b):
            break
        length, improved = 1.0, False
        for _ in range(8):
            largest = 0.0
            for i in range(6):
                tangent[i] = -length * b[i]
            for i in range(count):
                moved = coordinates[i] - length * b[6 + i]
                trial_coordinates[i] = min(max(moved, space.lower[i]), space.upper[i])
            _tangent_angles(space, pose, trial_coordinates, tangent)
            for i in range(26):
                largest = max(largest, abs(tangent[i]))
            retract(pose, tangent, trial)
            forward_kinematics(chain, trial, bodies)
            if energy(equations, bodies) + _prior(trial, damping) < current:
                improved = True
                break
            length *= 0.5
        if not improved:
            forward_kinematics(chain, pose, bodies)
            break
        for i in range(27):
            pose[i] = trial[i]
        for i in range(count):
            coordinates[i] = trial_coordinates[i]
        if largest < _ENOUGH:
            break
    return energy(equations, bodies) + _prior(pose, damping)


@numba.njit(cache=True, nogil=True)
def _tangent_angles(space: PostureSubspace, pose: Array, coordinates: Array, tangent: Array) -> None:
    """The change of the angles that leads to `coordinates`."""
    for j in range(20):
        if space.full:
            tangent[6 + j] = coordinates[j] - pose[7 + j]
        else:
            angle = space.mean[j]
            for i in range(coordinates.shape[0]):
                angle += space.basis[j, i] * coordinates[i]
            tangent[6 + j] = angle - pose[7 + j]


@numba.njit(cache=True, nogil=True)
def _reduce(H: Array, gradient: Array, space: PostureSubspace, A: Array, b: Array) -> None:
    """Normal equations of the space's parameters: J_PC = J M, Eq. (8)."""
    B, count, size = space.basis, space.basis.shape[1], b.shape[0]
    for i in range(size):
        kept = space.full or i < 6
        b[i] = gradient[i] if kept else 0.0
        for j in range(size):
            A[i, j] = H[i, j] if kept and (space.full or j < 6) else 0.0
    if space.full:
        return
    HB = np.empty(count)
    for j in range(20):
        row, first = 6 + j, j - j % 4
        for k in range(count):
            b[6 + k] += B[j, k] * gradient[row]
            # What an angle shares with those of other fingers is nothing.
            HB[k] = H[row, 6 + first] * B[first, k] + H[row, 7 + first] * B[first + 1, k]
            HB[k] += H[row, 8 + first] * B[first + 2, k] + H[row, 9 + first] * B[first + 3, k]
        for i in range(6):
            for k in range(count):
                A[i, 6 + k] += H[i, row] * B[j, k]
        for i in range(count):
            for k in range(i + 1):
                A[6 + i, 6 + k] += B[j, i] * HB[k]
    for i in range(6):
        for k in range(count):
            A[6 + k, i] = A[i, 6 + k]
    for i in range(count):
        for k in range(i):
            A[6 + k, 6 + i] = A[6 + i, 6 + k]


@numba.njit(cache=True, nogil=True)
def _reduced_precision(damping: Damping, space: PostureSubspace) -> Array:
    """The prior's precision (l, 20) between the space's parameters and the angles."""
    if space.full:
        return damping.precision
    count = space.basis.shape[1]
    pull = np.zeros((count, 20))
    for i in range(count):
        for k in range(20):
            for j in range(20):
                pull[i, j] += space.basis[k, i] * damping.precision[k, j]
    return pull


@numba.njit(cache=True, nogil=True)
def _prior(pose: Array, damping: Damping) -> float:
    """Half the squared distance, by `precision`, of the angles from rest."""
    total = 0.0
    for i in range(20):
        row = 0.0
        for j in range(20):
            row += damping.precision[i, j] * (pose[7 + j] - damping.mean[j])
        total += row * (pose[7 + i] - damping.mean[i])
    return 0.5 * total


@numba.njit(cache=True, nogil=True)
def _add_prior(pose: Array, damping: Damping, space: PostureSubspace, pull: Array, A: Array, b: Array) -> float:
    """Add the prior to the space's normal equations, `pull` being its `_reduced_precision`; returns `_prior`."""
    count = pull.shape[0]
    for i in range(count):
        for j in range(20):
            b[6 + i] += pull[i, j] * (pose[7 + j] - damping.mean[j])
            if space.full:
                A[6 + i, 6 + j] += pull[i, j]
            else:
                for k in range(count):
                    A[6 + i, 6 + k] += pull[i, j] * space.basis[j, k]
    return _prior(pose, damping)


@numba.njit(cache=True, nogil=True)
def cholesky_solve(A: Array, b: Array) -> bool:
    """Solve A x = b in place: A (n, n) is spent and b becomes x. False unless A is symmetric positive definite."""
    n = b.shape[0]
    for j in range(n):
        d = A[j, j]
        for k in range(j):
            d -= A[j, k] * A[j, k]
        if not d > 1e-14:
            return False
        d = np.sqrt(d)
        A[j, j] = d
        for i in range(j + 1, n):
            s = A[i, j]
            for k in range(j):
                s -= A[i, k] * A[j, k]
            A[i, j] = s / d
    for i in range(n):
        s = b[i]
        for k in range(i):
            s -= A[i, k] * b[k]
        b[i] = s / A[i, i]
    for i in range(n - 1, -1, -1):
        s = b[i]
        for k in range(i + 1, n):
            s -= A[k, i] * b[k]
        b[i] = s / A[i, i]
    return True
