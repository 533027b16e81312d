"""Problems of a posed hand, and their solutions.

The energy is half the weighted sum of squared residuals (m^2), plus half a quadratic prior on the finger angles. The
residuals come from found correspondences, accumulated in `NormalEquations`, and from `FixedPoints`. The parameters are
the six of the global pose and the coordinates of a `PostureSubspace` within its limits.
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.hand.compiled_kinematics import Chain
from depthtrack.hand.pose import ANGLES
from depthtrack.solver.fixed_points import FixedPoints
from depthtrack.solver.normal_equations import NormalEquations
from depthtrack.solver.prior import Prior
from depthtrack.solver.subspace import PostureSubspace
from depthtrack.types import Array


class SolverStatus(IntEnum):
    """Reason why the solver stopped.

    CONVERGED: the last step, or the decrease of the energy by it, fell below its tolerance.
    NO_PROGRESS: no halved step decreased the energy.
    ITERATION_LIMIT: all iterations were used.
    SINGULAR: the damped normal equations were not positive definite. The residuals and the damping leave a parameter
        undetermined.
    """

    CONVERGED = 0
    NO_PROGRESS = 1
    ITERATION_LIMIT = 2
    SINGULAR = 3


class Problem(NamedTuple):
    """Hand, residuals, prior on the angles, and free parameters with their limits."""

    chain: Chain
    equations: NormalEquations
    points: FixedPoints
    prior: Prior
    space: PostureSubspace


class SolverOptions(NamedTuple):
    """Iterations, damping and tolerances of the solver.

    iterations: largest number of steps.
    posture_damping: lambda of Eq. (4) on each finger angle or synergy, m^2/rad^2.
    pose_damping: damping of the translation (unitless). That of the rotation (m^2/rad^2) is a hundredth. It only keeps
        the system solvable.
    avoid_limits: increase the damping towards the limits (Schroeder et al. 2014, Sec. IV-B).
    step_tolerance: the solver stops after a step whose largest element is smaller, m or rad.
    energy_tolerance: the solver stops after a step that decreases the energy by a smaller share.
    energy_floor: the solver stops after a step that decreases the energy by less, m^2.
    halvings: lengths tried for a step, each half of the one before.
    """

    iterations: int
    posture_damping: float
    pose_damping: float = 1e-9
    avoid_limits: bool = False
    step_tolerance: float = 3e-5
    energy_tolerance: float = 0.0
    energy_floor: float = 0.0
    halvings: int = 8


class SolverState(NamedTuple):
    """Iterate of the solver, changed in place.

    pose: (27,).
    coordinates: (l,) of its angles in the subspace.
    slope: (l,) |dH/dx| of the joint limit function at the previous step.
    """

    pose: Array
    coordinates: Array
    slope: Array

    @staticmethod
    def at(pose: Array, space: PostureSubspace) -> "SolverState":
        """Return the state at the pose (27,) of the subspace that is nearest to `pose` (27,)."""
        start = np.array(pose, dtype=np.float64)
        coordinates = space.project(start[ANGLES])
        start[ANGLES] = space.angles(coordinates)
        return SolverState(start, coordinates, limit_gradients(coordinates, space.lower, space.upper))


Outcome = tuple[int, int, float]
"""Result of the compiled solver: status, number of steps, and final energy, m^2.

Kernels that Python calls return plain numbers and arrays, see `compilation.compiled`.
"""


@dataclass(frozen=True)
class Solution:
    """Solution of a problem.

    pose: (27,).
    status: why the solver stopped.
    iterations: accepted steps.
    energy: m^2, prior included.
    trace: (iterations + 1,) m^2, the energy at the start and after each step.
    """

    pose: Array
    status: SolverStatus
    iterations: int
    energy: float
    trace: Array

    @staticmethod
    def of(pose: Array, outcome: Outcome, trace: Array) -> "Solution":
        """Return the solution of a run of the compiled solver; `trace` may be longer than its steps."""
        status, iterations, energy = outcome
        return Solution(pose, SolverStatus(status), iterations, energy, trace[: iterations + 1].copy())

    @property
    def converged(self) -> bool:
        """Whether a tolerance was reached, or no step could decrease the energy further."""
        return self.status in (SolverStatus.CONVERGED, SolverStatus.NO_PROGRESS)


@compiled(nogil=True)
def limit_gradient(x: float, low: float, high: float) -> float:
    """Return |dH/dx| of the joint limit function (Schroeder et al. 2014, Sec. IV-B).

    H = (high - low)^2 / ((high - x) (x - low)).
    """
    room = max((high - x) * (x - low), 1e-9)
    return (high - low) ** 2 * abs(2 * x - high - low) / (room * room)


@compiled(nogil=True)
def limit_gradients(x: Array, low: Array, high: Array) -> Array:
    """Return `limit_gradient` of each coordinate (l,)."""
    out = np.empty(x.shape[0])
    for i in range(x.shape[0]):
        out[i] = limit_gradient(x[i], low[i], high[i])
    return out
