"""Sizes and side of a hand from keypoints in several poses; a missing keypoint is NaN."""

from typing import get_args

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.errors import InputError
from depthtrack.geometry.alignment import rigid_alignment
from depthtrack.hand.kinematics import KEYPOINT_NAMES, HandModel
from depthtrack.hand.shape import HandShape, Side
from depthtrack.solver.keypoints import IN_PALM, fit_poses, is_known
from depthtrack.types import Array

_ROUNDS = 5
"""Iterations of aligning all palms to their median and taking the median again."""
_STRETCHED = 0.7
"""Sine of the largest flexion at which the direction of a finger is used."""
_SAMPLE = 100
"""Number of hands that the side is determined from."""


def shape_from_keypoints(keypoints: ArrayLike, side: Side, source: str = "measured on keypoints") -> HandShape:
    """Return the sizes of a hand from its keypoints (N, 21, 3), metres, in N poses.

    Phalanx lengths are medians over the poses. Base joints are the median of the aligned palms. Sizes that keypoints do
    not determine, such as radii, are those of the default hand in proportion. If the wrist is missing, the median
    direction of the middle finger has zero abduction.

    Raises:
        InputError: if no pose has two neighbouring joints of a finger, or three points of the palm.
    """
    points = _checked(keypoints)
    default = HandShape()
    bones = np.linalg.norm(np.diff(points[:, 1:].reshape(-1, 5, 4, 3), axis=2), axis=-1)
    lengths = _median(bones)
    seen = np.isfinite(lengths)
    if not seen.any():
        raise InputError("no two neighbouring joints of a finger are known in any pose: hand sizes need them")
    ratio = float(lengths[seen].sum() / default.lengths[seen].sum())
    palm, wrist_known = _palm(points[:, IN_PALM], HandModel(default.with_(side=side)), ratio)
    bases = palm[1:] * [HandShape(side=side).mirror, 1, 1]
    if not wrist_known:
        bases = bases @ _turn(points, palm, side)
    return default.with_(
        side=side,
        scale=ratio,
        lengths=np.where(seen, lengths / ratio, default.lengths),
        bases=bases / ratio,
        palm_length=-2 * palm[0, 1] / ratio,
        source=source,
    )


def side_of(keypoints: ArrayLike) -> Side:
    """Return the side of hands with the smaller residual of a pose fit.

    keypoints: (N, 21, 3) metres.

    Raises:
        InputError: if `shape_from_keypoints` rejects the keypoints.
    """
    points = _checked(keypoints)
    sample = points[:: -(-len(points) // _SAMPLE)]

    def misfit(side: Side) -> float:
        return float(np.nanmean(fit_poses(HandModel(shape_from_keypoints(points, side)), sample).residuals))

    return min(get_args(Side), key=misfit)


def _checked(keypoints: ArrayLike) -> Array:
    """Return the hands with at least three palm points; missing points are NaN."""
    points = np.array(keypoints, dtype=np.float64).reshape(-1, len(KEYPOINT_NAMES), 3)
    known = is_known(points)
    points[~known] = np.nan
    points = points[known[:, IN_PALM].sum(axis=-1) >= 3]
    if not len(points):
        raise InputError("no pose shows three of wrist and base joints: hand sizes need them")
    return points


def _palm(points: Array, default: HandModel, ratio: float) -> tuple[Array, bool]:
    """Return wrist and base joints (6, 3), palm frame, and whether the wrist is known.

    points: (N, 6, 3) metres.
    """
    known = is_known(points)
    filled = np.where(known[..., None], points, 0)
    palm = reference = np.concatenate([default.shape.wrist[None], default.base_transforms[:, :3, 3]]) * ratio
    ever = np.asarray(known.any(axis=0), dtype=np.bool_)
    for _ in range(_ROUNDS):
        R, t = rigid_alignment(palm, filled, known)
        found = np.where(ever[:, None], _median(np.einsum("nji,nkj->nki", R, points - t[:, None])), palm)
        # The default palm defines the palm frame.
        R, t = rigid_alignment(found, reference, ever)
        palm = found @ R.T + t
    return palm, bool(ever[0])


def _turn(points: Array, palm: Array, side: Side) -> Array:
    """Return the rotation (3, 3) about the palm normal that points the middle finger forward.

    It is applied from the right.
    """
    known = is_known(points[:, IN_PALM])
    R, _ = rigid_alignment(palm, np.where(known[..., None], points[:, IN_PALM], 0), known)
    middle = KEYPOINT_NAMES.index("middle_mcp")
    x, y, z = np.moveaxis(np.einsum("nji,nj->ni", R, points[:, middle + 1] - points[:, middle]), -1, 0)
    stretched = (z < _STRETCHED * np.sqrt(x**2 + y**2 + z**2)) & (y > 0)
    if not stretched.any():
        return np.eye(3)
    angle = float(np.median(np.arctan2(x, y)[stretched])) * HandShape(side=side).mirror
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])


def _median(values: Array) -> Array:
    """Return the median of the known values over the first axis, NaN if there are none."""
    median = np.full(values.shape[1:], np.nan)
    ever = np.asarray(np.isfinite(values).any(axis=0))
    median[ever] = np.nanmedian(values[:, ever], axis=0)
    return median
