"""Smoothing of a stretch of a capture: the likeliest poses.

The energy is half the sum over frames of the squared distances of visible markers from the model, over their variance,
plus that of `MotionPrior`. It is minimised by Gauss-Newton steps over all frames of the stretch at once. A frame is
coupled to the two before it and the two after it, so the normal equations are banded.
"""

from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.geometry.rotations import quaternion_log, quaternion_product
from depthtrack.hand.compiled_kinematics import BodyPoses, Chain, forward_kinematics
from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import ANGLES, ORIENTATION, POSITION, retract
from depthtrack.markers.filling.motion_prior import MotionPrior
from depthtrack.solver.banded_systems import banded_cholesky, solve_lower, solve_upper
from depthtrack.solver.fixed_points import FixedPoints
from depthtrack.solver.normal_equations import NormalEquations, normal_equations
from depthtrack.types import Array, Index

_HALVINGS = 6
_DONE = 1e-6
"""Share of the energy by which a step must decrease it."""


class Stretch(NamedTuple):
    """Markers of T frames in a row.

    chain: the hand.
    bodies: (M,) of the markers.
    offsets: (T, M, 3) metres, body frames.
    targets: (T, M, 3) metres, capture frame; finite where the weight is not 0.
    weights: (T, M) 1/m^2, 0 for a missing marker.
    prior: on the motion.
    size: number of free parameters: 26, or 6 for a rigid body.
    """

    chain: Chain
    bodies: Index
    offsets: Array
    targets: Array
    weights: Array
    prior: MotionPrior
    size: int


class Smoothed(NamedTuple):
    """Poses (T, 27) of a stretch, and the banded Cholesky factor of their precision."""

    poses: Array
    factor: Array


def smooth(stretch: Stretch, start: Array, iterations: int) -> Smoothed:
    """Return the likeliest poses of three frames or more, from poses `start` (T, 27)."""
    poses, size = start, stretch.size
    energy, gradient, rows = _equations(stretch, poses)
    for _ in range(iterations):
        banded_cholesky(rows)
        solution = -gradient.reshape(-1, 1)
        solve_lower(rows, solution)
        solve_upper(rows, solution)
        step = np.zeros((len(poses), 26))
        step[:, :size] = solution.reshape(len(poses), size)
        before = energy
        for halving in range(_HALVINGS):
            trial = within_limits(retract(poses, step * 0.5**halving))
            trial_energy, trial_gradient, trial_rows = _equations(stretch, trial)
            if trial_energy < before:
                poses, energy, gradient, rows = trial, trial_energy, trial_gradient, trial_rows
                break
        else:
            return Smoothed(poses, rows)
        if before - energy < _DONE * before:
            break
    banded_cholesky(rows)
    return Smoothed(poses, rows)


def posterior_samples(smoothed: Smoothed, count: int, size: int) -> Array:
    """Return tangents (count, T, 26) drawn from the distribution about the smoothed poses.

    The draws are the same in every call.
    """
    frames = len(smoothed.poses)
    drawn = np.random.default_rng(0).standard_normal((frames * size, count))
    # The precision is L L^T, so L^-T maps a standard normal vector to a draw.
    solve_upper(smoothed.factor, drawn)
    tangents = np.zeros((count, frames, 26))
    tangents[..., :size] = np.moveaxis(drawn.reshape(frames, size, count), -1, 0)
    return tangents


def _equations(stretch: Stretch, poses: Array) -> tuple[float, Array, Array]:
    """Return energy, gradient (T, size) and rows (T size, 3 size) of the normal equations."""
    frames, size, prior = len(poses), stretch.size, stretch.prior
    H, gradient = np.empty((frames, 26, 26)), np.empty((frames, 26))
    energy = _marker_equations(
        stretch.chain, stretch.bodies, stretch.offsets, stretch.targets, stretch.weights, poses, H, gradient
    )
    H, gradient = H[:, :size, :size], gradient[:, :size].copy()
    posture, acceleration = prior.posture[:size, :size], prior.acceleration[:size, :size]
    away = np.zeros((frames, 26))
    away[:, 6:] = poses[:, ANGLES] - prior.mean[6:]
    pulled = away[:, :size] @ posture
    second = _second_differences(poses)[:, :size]
    forced = second @ acceleration
    energy += 0.5 * float(np.sum(pulled * away[:, :size]) + np.sum(forced * second))
    gradient += pulled
    gradient[:-2] += forced
    gradient[1:-1] -= 2 * forced
    gradient[2:] += forced
    return energy, gradient, _banded(H + posture, acceleration)


def _second_differences(poses: Array) -> Array:
    """Return the second differences (T - 2, 26) of poses in the tangent space."""
    q = poses[:, ORIENTATION]
    turns = quaternion_log(quaternion_product(q[1:], q[:-1] * np.array([1.0, -1.0, -1.0, -1.0])))
    return np.concatenate(
        [np.diff(poses[:, POSITION], n=2, axis=0), np.diff(turns, axis=0), np.diff(poses[:, ANGLES], n=2, axis=0)],
        axis=1,
    )


@compiled(nogil=True)
def _banded(diagonal: Array, acceleration: Array) -> Array:
    """Return the precision as rows of `banded_systems`: blocks (T, n, n) plus accelerations.

    D (T - 2, T) takes second differences.
    """
    frames, size = diagonal.shape[0], diagonal.shape[1]
    rows = np.zeros((frames * size, 3 * size))
    for t in range(frames):
        # The elements of D^T D in column t: 1, -4, 6 but near the ends.
        zeroth, first, second = 0.0, 0.0, 0.0
        for i, d in enumerate((1.0, -2.0, 1.0)):
            if 0 <= t - i < frames - 2:
                zeroth += d * d
                first += d * (-2.0 if i == 0 else 1.0 if i == 1 else 0.0)
                second += 1.0 if i == 0 else 0.0
        for column in range(size):
            row = rows[t * size + column]
            for i in range(size):
                if i >= column:
                    row[i - column] = diagonal[t, i, column] + zeroth * acceleration[i, column]
                row[size + i - column] += first * acceleration[i, column]
                row[2 * size + i - column] += second * acceleration[i, column]
    return rows


@compiled(nogil=True)
def _marker_equations(
    chain: Chain, bodies: Index, offsets: Array, targets: Array, weights: Array, poses: Array, H: Array, g: Array
) -> float:
    """Write J^T J (T, 26, 26) and J^T e (T, 26) of the markers of each frame; return the energy."""
    moved, total, count = BodyPoses(np.empty((16, 3, 4)), np.empty((20, 3)), np.empty((20, 3))), 0.0, bodies.shape[0]
    direction, centre = np.zeros((count, 3)), np.empty(3)
    none = NormalEquations(np.zeros((16, 6, 8)), np.zeros(16), np.zeros((16, 3, 4)), centre)
    for t in range(poses.shape[0]):
        forward_kinematics(chain, poses[t], moved)
        centre[:] = poses[t, :3]
        points = FixedPoints(bodies, offsets[t], targets[t], direction, weights[t])
        total += normal_equations(none, points, moved, H[t], g[t])
    return total
