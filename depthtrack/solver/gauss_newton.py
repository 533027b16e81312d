"""Compiled Gauss-Newton for problems of a posed hand: projected, damped, with step halving.

The step is that of Schroeder et al. 2014, Eq. (4). A parameter at a limit takes no part in a step that would push it
beyond (Bertsekas, "Projected Newton methods", SIAM J. Control and Optimization 20(2), 1982). A step is halved until it
decreases the energy.
"""

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.hand.compiled_kinematics import BodyPoses, forward_kinematics
from depthtrack.hand.compiled_tangent import retract
from depthtrack.solver.linear_algebra import cholesky_solve, hold_parameter
from depthtrack.solver.normal_equations import energy, normal_equations
from depthtrack.solver.prior import add_prior, prior_energy, reduced_precision
from depthtrack.solver.problem import (
    Outcome,
    Problem,
    Solution,
    SolverOptions,
    SolverState,
    SolverStatus,
    limit_gradient,
)
from depthtrack.solver.subspace import PostureSubspace, reduce_to_subspace, write_angle_step
from depthtrack.types import Array


def minimise(problem: Problem, options: SolverOptions, start: Array) -> Solution:
    """Return the solution reached from the pose `start` (27,), with fixed correspondences."""
    state, trace = SolverState.at(start, problem.space), np.empty(options.iterations + 1)
    outcome = solve(problem, options, BodyPoses.empty(), state, trace)
    return Solution.of(state.pose, outcome, trace)


@compiled(nogil=True)
def solve(problem: Problem, options: SolverOptions, bodies: BodyPoses, state: SolverState, trace: Array) -> Outcome:
    """Move `state` to a minimum of the energy.

    bodies: receive the transforms of the final pose.
    trace: at least (iterations + 1,), receives the energies, m^2.
    """
    chain, space, prior = problem.chain, problem.space, problem.prior
    pose, coordinates, slope = state.pose, state.coordinates, state.slope
    count = coordinates.shape[0]
    size = 6 + count
    H, gradient = np.empty((26, 26)), np.empty(26)
    A, b, tangent = np.empty((size, size)), np.empty(size), np.empty(26)
    trial, trial_coordinates = np.empty(27), np.empty(count)
    pull = reduced_precision(prior, space)
    forward_kinematics(chain, pose, bodies)
    status, steps, reached, best = SolverStatus.ITERATION_LIMIT, 0, False, 0.0
    for _ in range(options.iterations):
        current = normal_equations(problem.equations, problem.points, bodies, H, gradient)
        reduce_to_subspace(H, gradient, space, A, b)
        current += add_prior(pose, prior, space, pull, A, b)
        if steps == 0:
            best, trace[0], reached = current, current, True
        _damp(A, coordinates, slope, space, options)
        for i in range(count):
            # A parameter at its limit that would be pushed beyond takes no part in the step.
            push = -b[6 + i]
            if (coordinates[i] <= space.lower[i] and push < 0) or (coordinates[i] >= space.upper[i] and push > 0):
                hold_parameter(A, b, 6 + i)
        if not cholesky_solve(A, b):
            status = SolverStatus.SINGULAR
            break
        length, largest, improved = 1.0, 0.0, False
        for _ in range(options.halvings):
            largest = 0.0
            for i in range(6):
                tangent[i] = -length * b[i]
            for i in range(count):
                moved = coordinates[i] - length * b[6 + i]
                trial_coordinates[i] = min(max(moved, space.lower[i]), space.upper[i])
            write_angle_step(space, pose, trial_coordinates, tangent)
            for i in range(26):
                largest = max(largest, abs(tangent[i]))
            retract(pose, tangent, trial)
            forward_kinematics(chain, trial, bodies)
            best = energy(problem.equations, problem.points, bodies) + prior_energy(trial, prior)
            if best < current:
                improved = True
                break
            length *= 0.5
        if not improved:
            forward_kinematics(chain, pose, bodies)
            best, status = current, SolverStatus.NO_PROGRESS
            break
        for i in range(27):
            pose[i] = trial[i]
        for i in range(count):
            coordinates[i] = trial_coordinates[i]
        steps += 1
        trace[steps] = best
        gain = current - best
        if largest < options.step_tolerance or gain < options.energy_tolerance * current + options.energy_floor:
            status = SolverStatus.CONVERGED
            break
    if not reached:
        best = energy(problem.equations, problem.points, bodies) + prior_energy(pose, prior)
        trace[0] = best
    return status.value, steps, best


@compiled(nogil=True)
def solve_each(
    problem: Problem, options: SolverOptions, targets: Array, weights: Array, poses: Array, energies: Array
) -> None:
    """Fit the points of the problem to each row of targets; `poses` change in place.

    targets: (B, N, 3) metres, camera frame.
    weights: (B, N).
    poses: (B, 27) within the limits.
    energies: (B,) m^2, output.
    """
    bodies = BodyPoses(np.empty((16, 3, 4)), np.empty((20, 3)), np.empty((20, 3)))
    trace, count = np.empty(options.iterations + 1), problem.space.lower.shape[0]
    coordinates, slope, angles = np.empty(count), np.zeros(count), np.empty(20)
    for n in range(poses.shape[0]):
        points, pose = problem.points, poses[n]
        for k in range(weights.shape[1]):
            points.weight[k] = weights[n, k]
            for i in range(3):
                points.target[k, i] = targets[n, k, i]
        for i in range(3):
            problem.equations.centre[i] = pose[i]
        for j in range(20):
            angles[j] = pose[7 + j] - problem.space.mean[j]
        for i in range(count):
            coordinates[i] = 0.0
            for j in range(20):
                coordinates[i] += problem.space.basis[j, i] * angles[j]
        energies[n] = solve(problem, options, bodies, SolverState(pose, coordinates, slope), trace)[2]


@compiled(nogil=True)
def _damp(A: Array, coordinates: Array, slope: Array, space: PostureSubspace, options: SolverOptions) -> None:
    """Add the damping to the diagonal of A, and store the slopes of the joint limit function."""
    for i in range(3):
        A[i, i] += options.pose_damping
        A[3 + i, 3 + i] += options.pose_damping * 1e-2
    for i in range(coordinates.shape[0]):
        here = limit_gradient(coordinates[i], space.lower[i], space.upper[i])
        scale = 1.0 + here if options.avoid_limits and here >= slope[i] else 1.0
        slope[i] = here
        A[6 + i, 6 + i] += options.posture_damping * scale
