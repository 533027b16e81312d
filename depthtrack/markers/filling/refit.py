"""Poses of labelled markers, solved again where the labels have changed."""

import numpy as np

from depthtrack.hand.pose import ANGLES
from depthtrack.markers.filled_capture import runs
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.solver.point_fit import PointFitOptions, fit_points
from depthtrack.solver.prior import Prior
from depthtrack.types import Array, Mask

_HOLD = 1e-6
"""Weight of the angles of the frame before, m^2/rad^2: joints without a marker keep them."""
_OPTIONS = PointFitOptions(iterations=20)


def refitted_poses(model: MarkerModel, measured: Array, poses: Array, frames: Mask) -> Array:
    """Return the poses (T, 27) with those of some frames solved again.

    measured: (T, M, 3) metres, NaN if not measured.
    poses: (T, 27) capture frame.
    frames: (T,) to solve again; a frame without three markers, or without a pose before it, is lost.
    """
    solved = np.array(poses)
    chain, prior = model.kinematics.chain, Prior.towards
    for start, stop in runs(frames):
        last = solved[start - 1] if start > 0 else np.full(27, np.nan)
        for t in range(start, stop):
            enough = np.isfinite(measured[t]).all(axis=-1).sum() >= 3
            if not enough or not np.isfinite(last).all():
                solved[t] = np.nan
                continue
            last = fit_points(
                chain, model.bodies, model.offsets, measured[t],
                start=last, prior=prior(last[ANGLES], _HOLD), options=_OPTIONS,
            ).pose  # fmt: skip
            solved[t] = last
    return solved
