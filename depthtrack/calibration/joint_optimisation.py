"""Joint optimisation of sizes and poses: Gauss-Newton on several views of one hand.

Every pose concerns one view only. The poses are eliminated first (Schur complement); what remains is the information
of all views about the sizes. Shared sizes over several views follow Taylor et al., "User-specific hand modeling from
monocular depth sequences", CVPR 2014. The other views and the prior determine sizes that one view leaves open, as in
Tan et al., "Fits like a glove", CVPR 2016.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np

from depthtrack.calibration.options import JointFitOptions
from depthtrack.calibration.residuals import CalibrationView, PosedSkin, linearise, stretches
from depthtrack.calibration.solid_hands import is_solid, solid_step
from depthtrack.hand.displacement_grid import NODES, neighbour_differences
from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import ANGLES, retract
from depthtrack.hand.shape import Side
from depthtrack.hand.size_parameters import COUNT, hand_of, placement_covariance, prior_covariance
from depthtrack.solver.shared_parameters import EliminatedPose, eliminate_pose, solve_free
from depthtrack.types import Array


@dataclass(frozen=True)
class JointFit:
    """Sizes and poses that fit all views.

    values: (35,) sizes, see `hand.size_parameters`; behind them the displacement of the skin if it was fitted.
    covariance: (35, 35) of the sizes given views and prior.
    poses: (V, 27).
    distances: (V,) metres, median distance of the points of each view to the skin.
    """

    values: Array
    covariance: Array
    poses: Array
    distances: Array


def fit_jointly(
    views: Sequence[CalibrationView],
    poses: Array,
    values: Array,
    side: Side,
    iterations: int,
    free: slice = slice(None),
    exact: bool = False,
    options: JointFitOptions | None = None,
    threads: int = 1,
) -> JointFit:
    """Return the sizes and poses that fit all views best.

    poses: (V, 27) to start from.
    values: (35,) sizes to start from; or sizes and displacement of the skin, which are then fitted together and need
        `exact`.
    free: the sizes that may change; all by default.
    exact: stretch the skin of the sizes to start from, instead of the average hand's (see `PosedSkin`), with the final
        kernel scale. It is built again if the sizes changed by `JointFitOptions.rebuilt`. The sizes to start from must
        give a solid hand, and steps to others are shortened if those do not.
    threads: among which the views are divided. Sizes and poses do not depend on their number.
    """
    options = options or JointFitOptions()
    soft, firm = (options.kernel_scale[1],) * 2 if exact else options.kernel_scale
    poses, values = within_limits(poses), values.copy()
    displaced = len(values) > COUNT
    prior = prior_information(options, displaced)
    held = np.ones(len(values), dtype=np.bool_)
    held[free] = False
    built = values[:COUNT] if exact else np.zeros(COUNT)
    with ThreadPoolExecutor(threads, thread_name_prefix="views") as pool:
        for k in range(iterations):
            skin = PosedSkin(hand_of(values, side), hand_of(np.append(built, values[COUNT:]), side))
            kernel_scale = soft * (firm / soft) ** (k / max(iterations - 1, 1))
            contribution = partial(_contribution, skin=skin, scale=kernel_scale, displaced=displaced, options=options)
            information: Array = np.zeros((len(values), len(values)))
            gradient = np.zeros(len(values))
            steps, distances = list[tuple[Array, Array]](), list[float]()
            for eliminated, distance in pool.map(contribution, views, poses):
                information += eliminated.information
                gradient += eliminated.gradient
                steps.append((eliminated.step, eliminated.step_by_shared))
                distances.append(distance)
            change = solve_free(information + prior, -(gradient + prior @ values), held)
            change *= min(1.0, options.largest_change / max(np.abs(change[:COUNT]).max(), 1e-12))
            before, values = values, values + change
            if exact and _differ(values, built, side, options.rebuilt):
                values = solid_step(before, change, side)
                change = values - before
                # Sizes may have left the solid ones in smaller steps. The skin then stays as it was built.
                built = values[:COUNT] if is_solid(values[:COUNT], side) else built
            tangents = np.stack([step + by_shared @ change for step, by_shared in steps])
            poses = within_limits(retract(poses, tangents))
    covariance = np.asarray(np.linalg.inv(information + prior)[:COUNT, :COUNT], dtype=np.float64)
    return JointFit(values, covariance, poses, np.array(distances))


def size_covariance(options: JointFitOptions) -> Array:
    """Return the prior covariance (35, 35) of the sizes.

    It is that among people, and that of the places of joints in their flesh.
    """
    return prior_covariance() + placement_covariance(options.joint_places, options.palm_flesh)


def prior_information(options: JointFitOptions, displaced: bool) -> Array:
    """Return the inverse covariance (n, n) of the parameters before any view.

    They are the sizes, and the displacement of the skin if wanted. Displacements are
    small, and those of neighbouring nodes alike.
    """
    sizes: Array = np.linalg.inv(size_covariance(options)).astype(np.float64, copy=False)
    if not displaced:
        return sizes
    differences = neighbour_differences()
    skin = np.eye(NODES) / options.displacement**2
    skin += (differences.T @ differences).toarray() / options.displacement_difference**2
    both = np.zeros((COUNT + NODES, COUNT + NODES))
    both[:COUNT, :COUNT], both[COUNT:, COUNT:] = sizes, skin
    return both


def _differ(values: Array, built: Array, side: Side, most: float) -> bool:
    """Return whether a skin must be stretched or moved by more than `most`.

    values: (n,) that it is needed for.
    built: (35,) that it was built for.
    """
    hand, other = hand_of(values[:COUNT], side), hand_of(built, side)
    factors = np.diagonal(stretches(hand, other)[:, :3, :3], axis1=1, axis2=2)
    shifts = (hand.bases * hand.scale - other.bases * other.scale) / (other.palm_length * other.scale)
    return bool(max(np.abs(np.log(factors)).max(), np.abs(shifts).max()) > most)


def _contribution(
    view: CalibrationView, pose: Array, skin: PosedSkin, scale: float, displaced: bool, options: JointFitOptions
) -> tuple[EliminatedPose, float]:
    """Return the normal equations of the sizes for one view, and its distance.

    They are scaled to its number of independent measurements.

    scale: m, of the Geman-McClure kernel.
    """
    evidence = linearise(view, pose, skin, scale, displaced)
    misfit = options.displaced_misfit if displaced else options.misfit
    noise = max(options.noise, misfit * evidence.distance) ** 2
    share = min(view.patches / max(evidence.count, 1), 1.0) / noise
    damping = 1 / np.repeat(options.step_spread, [3, 3, 20]) ** 2
    evidence.H[:] *= share
    return eliminate_pose(evidence.H, share * evidence.g, pose[ANGLES], damping), evidence.distance
