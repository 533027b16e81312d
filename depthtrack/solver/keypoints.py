"""Fits the hand to keypoints: inverse kinematics with known correspondences (Schroeder et al. 2014, Sec. IV-A).

Keypoints are the 21 of `kinematics.KEYPOINT_NAMES`, the wrist first; a joint that is not known is NaN.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthtrack.geometry.alignment import rigid_alignment
from depthtrack.geometry.rotations import quaternion_from_matrix
from depthtrack.hand.kinematics import KEYPOINT_NAMES, HandModel, body_of
from depthtrack.hand.limits import LOWER, UPPER, within_limits
from depthtrack.hand.pose import ANGLES, POSE_SIZE, TANGENT_SIZE, make_pose, retract
from depthtrack.hand.postures import POSTURES
from depthtrack.types import Array, Mask

KEYPOINT_BODIES = np.array(
    [0, *(body_of(finger, phalanx) for finger in range(5) for phalanx in (0, 0, 1, 2))], dtype=np.int64
)
"""(21,) body that each keypoint is fixed to. A joint belongs to the bone before it, which alone moves it."""

IN_PALM = np.array([0, 1, 5, 9, 13, 17])
"""Wrist and base joints: they move with the palm, whatever the fingers do."""
_FINGERS_SAY = 0.01
"""Weight of the other keypoints in the first alignment, against 1: enough where the palm's are missing."""
_DAMPING = 1e-8
"""lambda of Eq. (3) for the angles, in m^2/rad^2: it only keeps angles that no known keypoint tells where they are."""
_HALVINGS = 8
_GAIN, _EXACT = 1e-8, 1e-17
"""A step that lowers the error by a smaller share, or by fewer m^2 (nanometres), is the last."""
_CHUNK = 1024
"""Hands fitted at a time, so that memory stays bounded."""


@dataclass(frozen=True)
class FittedPoses:
    """`poses` (N, 27), within the joint limits; `residuals` (N,), root mean square distance in metres from the known
    keypoints. Both are NaN for hands with fewer than three of them."""

    poses: Array
    residuals: Array


def fit_poses(model: HandModel, keypoints: ArrayLike, iterations: int = 60) -> FittedPoses:
    """Poses that bring the model's keypoints closest to `keypoints` (N, 21, 3), metres, camera frame.

    From a relaxed hand, aligned rigidly, by damped Gauss-Newton steps with step halving (Eq. 3-5), each projected
    onto the joint limits (Bertsekas, "Projected Newton methods", SIAM J. Control and Optimization 20(2), 1982). Hands
    with unknown finger joints are fitted from a fist as well, and the better pose is kept.
    """
    targets = np.asarray(keypoints, dtype=np.float64).reshape(-1, len(KEYPOINT_NAMES), 3)
    poses, residuals = np.full((len(targets), POSE_SIZE), np.nan), np.full(len(targets), np.nan)
    known = is_known(targets)
    usable = np.flatnonzero(known.sum(axis=-1) >= 3)
    filled = np.where(known[..., None], targets, 0)
    with_gaps = usable[~known[usable, 1:].all(axis=-1)]
    for start, hands in (("relaxed", usable), ("fist", with_gaps)):
        for chunk in np.array_split(hands, -(-len(hands) // _CHUNK) or 1):
            fitted, cost = _fit(model, POSTURES[start], filled[chunk], known[chunk], iterations)
            residual = np.sqrt(2 * cost / known[chunk].sum(axis=-1))
            better = ~(residual >= residuals[chunk])  # than another start, or than none
            poses[chunk[better]], residuals[chunk[better]] = fitted[better], residual[better]
    return FittedPoses(poses, residuals)


def is_known(points: Array) -> Mask:
    """Which points (..., 3) have all their coordinates (...)."""
    return np.asarray(np.isfinite(points).all(axis=-1), dtype=np.bool_)


def _fit(model: HandModel, start: Array, targets: Array, known: Mask, iterations: int) -> tuple[Array, Array]:
    """Poses (B, 27) and the error term of Eq. (3) (B,), from finger angles `start` (20,)."""
    poses = _first_poses(model, start, targets, known)
    costs = _cost(model, poses, targets, known)
    active = np.arange(len(poses))
    for _ in range(iterations):
        if not len(active):
            break
        steps = _newton_steps(model, poses[active], targets[active], known[active])
        improved = _walk(model, poses, costs, steps, active, targets, known)
        active = active[improved]
    return poses, costs


def _first_poses(model: HandModel, start: Array, targets: Array, known: Mask) -> Array:
    """The hand with these angles, brought to the targets by its palm alone as far as they show it."""
    upright = make_pose(np.zeros(3), (1, 0, 0, 0), start)
    weights = np.full(len(KEYPOINT_NAMES), _FINGERS_SAY)
    weights[IN_PALM] = 1
    R, t = rigid_alignment(model.keypoints(upright), targets, weights * known)
    return make_pose(t, quaternion_from_matrix(R), start)


def _newton_steps(model: HandModel, poses: Array, targets: Array, known: Mask) -> Array:
    """Steps (B, 26) of Eq. (4); an angle at its limit that would leave it stays out of the system."""
    points = model.keypoints(poses)
    J = (model.point_jacobian(poses, KEYPOINT_BODIES, points) * known[..., None, None]).reshape(len(poses), -1, 26)
    e = ((targets - points) * known[..., None]).reshape(len(poses), -1, 1)
    A, g = np.swapaxes(J, -1, -2) @ J, (np.swapaxes(J, -1, -2) @ e)[..., 0]
    A += np.diag(np.repeat([1e-12, _DAMPING], [6, 20]))
    angles = poses[:, ANGLES]
    held = np.zeros((len(poses), TANGENT_SIZE), dtype=np.bool_)
    held[:, 6:] = ((angles <= LOWER) & (g[:, 6:] < 0)) | ((angles >= UPPER) & (g[:, 6:] > 0))
    A[held[:, :, None] | held[:, None, :]] = 0
    A[held[:, :, None] & np.eye(TANGENT_SIZE, dtype=np.bool_)] = 1
    g[held] = 0
    return np.asarray(np.linalg.solve(A, g[..., None])[..., 0], dtype=np.float64)


def _walk(
    model: HandModel,
    poses: Array,
    costs: Array,
    steps: Array,
    active: NDArray[np.intp],
    targets: Array,
    known: Mask,
) -> Mask:
    """Take each step, halved until the error decreases; poses and costs change in place. Returns who gets on."""
    before = costs[active].copy()
    waiting = np.arange(len(active))
    for halving in range(_HALVINGS):
        hands = active[waiting]
        trial = within_limits(retract(poses[hands], steps[waiting] / 2**halving))
        cost = _cost(model, trial, targets[hands], known[hands])
        better = cost < costs[hands]
        poses[hands[better]], costs[hands[better]] = trial[better], cost[better]
        waiting = waiting[~better]
        if not len(waiting):
            break
    return before - costs[active] > _GAIN * before + _EXACT


def _cost(model: HandModel, poses: Array, targets: Array, known: Mask) -> Array:
    """Half the sum of squared distances (B,), m^2, over the known keypoints."""
    return 0.5 * np.sum(((model.keypoints(poses) - targets) * known[..., None]) ** 2, axis=(-2, -1))
