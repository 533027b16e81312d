"""Sizes and poses together: Gauss-Newton on several views of one hand, whose sizes they share.

Every pose concerns one view only, so that the poses are eliminated first (Schur complement), and what is left for the
sizes is what all views say of them whatever the poses are: their information. Shared sizes over several views after
Taylor et al., "User-specific hand modeling from monocular depth sequences", CVPR 2014; sizes that one view does not
tell are held by the others and by the prior as in Tan et al., "Fits like a glove", CVPR 2016.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from depthtrack.calibration.parameters import COUNT, hand_of, prior_covariance
from depthtrack.calibration.residuals import CalibrationView, Evidence, PosedSkin, linearise
from depthtrack.hand.limits import LOWER, UPPER, within_limits
from depthtrack.hand.pose import ANGLES, TANGENT_SIZE, retract
from depthtrack.hand.shape import Side
from depthtrack.types import Array, Mask

_SOFTNESS = (0.020, 0.006)
"""Metres, in the first and in the last round: distances from which on a residual counts less."""
_NOISE, _MISFIT = 0.0015, 2.5
"""Metres: standard deviation of one patch of skin about the model, at best; and in median distances to the skin: what
no sizes of the model can fit is alike in all views, and does not average out."""
_STEP = np.concatenate([np.full(3, 0.03), np.full(3, 0.2), np.full(20, 0.3)])
"""Standard deviation of a pose's step (m, rad, rad) that keeps what the view does not tell where it is."""
_LARGEST = 0.08
"""Largest change of a size in one round, of the logarithm: the skin is linear about so far."""


@dataclass(frozen=True)
class JointFit:
    """`values` (35,) of `sizes`, their `covariance` (35, 35) given views and prior, `poses` (V, 27), and `distances`
    (V,), the median distance (m) of each view's points to the skin."""

    values: Array
    covariance: Array
    poses: Array
    distances: Array


def fit_jointly(
    views: Sequence[CalibrationView],
    poses: Array,
    values: Array,
    side: Side,
    rounds: int,
    free: slice = slice(0, COUNT),
    exact: bool = False,
) -> JointFit:
    """Sizes and poses that explain all views best, from `poses` (V, 27) and `values` (35,); only `free` sizes move.

    `exact` makes the skin anew in every round (see `PosedSkin`), and begins where most is known already.
    """
    kernel_scale = (_SOFTNESS[1], _SOFTNESS[1]) if exact else _SOFTNESS
    poses, values = within_limits(poses), values.copy()
    prior = np.linalg.inv(prior_covariance())
    held = np.ones(COUNT, dtype=np.bool_)
    held[free] = False
    for k in range(rounds):
        skin = PosedSkin(hand_of(values, side), exact)
        s = kernel_scale[0] * (kernel_scale[1] / kernel_scale[0]) ** (k / max(rounds - 1, 1))
        evidence = [linearise(view, skin, pose, s) for view, pose in zip(views, poses, strict=True)]
        information, gradient, steps = _eliminate(views, evidence, poses)
        change = _solve(information + prior, -(gradient + prior @ values), held)
        change *= min(1.0, _LARGEST / max(np.abs(change).max(), 1e-12))
        values = values + change
        tangents = np.stack([own + by_sizes @ change for own, by_sizes in steps])
        poses = within_limits(retract(poses, tangents))
    distances = np.array([e.distance for e in evidence])
    return JointFit(values, np.linalg.inv(information + prior), poses, distances)


def _eliminate(
    views: Sequence[CalibrationView], evidence: Sequence[Evidence], poses: Array
) -> tuple[Array, Array, list[tuple[Array, Array]]]:
    """Information (35, 35) and gradient (35,) of the sizes, the poses following them; and for each view how its pose
    moves: by itself (26,), and (26, 35) with the sizes."""
    information: Array = np.zeros((COUNT, COUNT))
    gradient: Array = np.zeros(COUNT)
    steps: list[tuple[Array, Array]] = []
    for view, e, pose in zip(views, evidence, poses, strict=True):
        # As many measurements as there are patches, each as sure as sensor and model allow.
        noise = max(_NOISE, _MISFIT * e.distance) ** 2
        worth = min(view.patches / max(e.count, 1), 1.0) / noise
        H, g = worth * e.H, worth * e.g
        A, b = H[:TANGENT_SIZE, :TANGENT_SIZE] + np.diag(1 / _STEP**2), g[:TANGENT_SIZE].copy()
        C = H[:TANGENT_SIZE, TANGENT_SIZE:].copy()
        angles = pose[ANGLES]
        stuck = np.zeros(TANGENT_SIZE, dtype=np.bool_)
        stuck[6:] = ((angles <= LOWER) & (b[6:] > 0)) | ((angles >= UPPER) & (b[6:] < 0))
        A[stuck], A[:, stuck], b[stuck], C[stuck] = 0, 0, 0, 0
        A[stuck, stuck] = 1
        solved: Array = np.linalg.solve(A, np.column_stack([b, C])).astype(np.float64, copy=False)
        own, by_sizes = -solved[:, 0], -solved[:, 1:]
        information += H[TANGENT_SIZE:, TANGENT_SIZE:] + C.T @ by_sizes
        gradient += g[TANGENT_SIZE:] + C.T @ own
        steps.append((own, by_sizes))
    return information, gradient, steps


def _solve(A: Array, b: Array, held: Mask) -> Array:
    """x (35,) with A x = b where sizes are not held."""
    x = np.zeros(COUNT)
    free = ~held
    x[free] = np.linalg.solve(A[np.ix_(free, free)], b[free])
    return x
