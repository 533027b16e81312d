"""Gap filling of Maycock et al. 2015, Fig. 4."""

import numpy as np

from depthtrack.markers.filled_capture import Filling, measured_samples, runs
from depthtrack.markers.filling.bridging import bridged
from depthtrack.markers.filling.expected_error import error_after
from depthtrack.markers.filling.joints import affecting, determined
from depthtrack.markers.filling.options import PaperFillOptions
from depthtrack.markers.filling.prediction import Prediction, time_to_measured
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.types import Array, Mask


def paper_fill(model: MarkerModel, measured: Array, poses: Array, rate: float, options: PaperFillOptions) -> Prediction:
    """Return the markers of a model wherever they are missing.

    measured: (T, M, 3) metres, capture frame; NaN if not measured.
    poses: (T, 27) capture frame: inverse kinematics of the visible markers in each frame.
    rate: frames a second, Hz.

    The joints that no visible marker determines are frozen until a marker reappears in a plausible place. Then their
    angles are interpolated from the frame before the gap to the one after it. All gaps are filled in parallel.
    """
    visible = measured_samples(measured)
    accepted = _plausible(model, measured, poses, visible, options)
    known = determined(model, accepted) | ~determined(model, np.ones(len(model.labels), dtype=np.bool_))
    filled = bridged(poses, known)
    how = np.full(visible.shape, int(Filling.KINEMATIC))
    for m in range(visible.shape[1]):
        joints = affecting(model, m) & known.any(axis=0)
        how[~known[:, joints].all(axis=1), m] = Filling.INTERPOLATED
    how[visible & ~accepted] = Filling.REPLACED
    error = error_after("paper", time_to_measured(accepted, rate))
    return Prediction(model.positions(filled), how, error, filled)


def _plausible(model: MarkerModel, measured: Array, poses: Array, visible: Mask, options: PaperFillOptions) -> Mask:
    """Return which visible markers (T, M) are accepted.

    After a gap, a marker is accepted from the first frame in which it is near the model, articulated towards it.
    Its distance is then at most the mean of all markers plus a small term.
    """
    distance = np.linalg.norm(measured - model.positions(poses), axis=-1)
    accepted = visible.copy()
    if not np.isfinite(distance).any():
        return accepted
    near = distance <= np.nanmean(distance) + options.plausible_distance
    for m in range(visible.shape[1]):
        for start, stop in runs(visible[:, m]):
            good = np.flatnonzero(near[start:stop, m])
            if start > 0 and len(good) > 0:
                accepted[start : start + good[0], m] = False
    return accepted
