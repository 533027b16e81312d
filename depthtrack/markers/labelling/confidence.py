"""Probability that a label is right, from logistic regressions.

They were fitted to synthetic captures of seeds below 100 by `tools/calibrate_label_confidence.py`.
"""

import numpy as np

from depthtrack.markers.labelling.capture_fit import FittedFrames
from depthtrack.markers.labelling.packed import PackedPoints
from depthtrack.markers.labelling.state import LARGEST_MISFIT, Settings
from depthtrack.types import Array, Index, Mask

ONLINE = np.array([5.81, -0.005, -6.004, 0.764])
"""Weights of 1, margin, log(1 + misfit) and logarithm of the frames in a row with a point, online."""
OFFLINE = np.array([-4.267, -0.207, 1.665, 6.241, 4.203, -6.526])
"""Weights of 1, margin a frame, logarithm of the frames, rival, passes that agree, log(1 + misfit), offline."""
SUREST = 0.9999
"""Largest confidence: the share of errors among the surest labels of the captures is not known more exactly."""


def confidence(features: Array, weights: Array) -> Array:
    """Return the probability (...) that labels are right, from features (..., F)."""
    return np.asarray(np.minimum(1 / (1 + np.exp(-(features @ weights))), SUREST))


def offline_features(
    points: PackedPoints,
    tracklet: Index,
    labels: Index,
    evidence: Array,
    rivals: Mask,
    passes: tuple[Index, Index],
    fitted: FittedFrames,
    settings: Settings,
) -> Array:
    """Return the features (T, M, 6) of all samples, see `OFFLINE`; NaN without a point.

    labels: (T, M) numbers of points.
    evidence: (K, M) of each tracklet being each marker.
    rivals: (K,) whether another point could be the tracklet's marker.
    passes: labels (T, M) of the tracker in both directions.
    """
    out = np.full((*labels.shape, len(OFFLINE)), np.nan)
    frames = np.bincount(tracklet, minlength=len(evidence))
    t, i = np.nonzero(labels >= 0)
    k = tracklet[labels[t, i]]
    others = evidence[k].copy()
    others[np.arange(len(k)), i] = 0.0
    spread = np.sqrt(fitted.scatter[i] ** 2 + 3 * settings.noise**2)
    misfit = np.linalg.norm(fitted.residuals[t, i] - fitted.usual[i], axis=1) / spread
    out[t, i] = np.stack(
        [
            np.ones(len(k)),
            np.clip((evidence[k, i] - np.maximum(others.max(axis=1, initial=0.0), 0.0)) / frames[k], -10.0, 12.0),
            np.log(frames[k]),
            rivals[k],
            sum((each[t, i] == labels[t, i]).astype(np.float64) for each in passes),
            np.log1p(np.minimum(np.nan_to_num(misfit), LARGEST_MISFIT)),
        ],
        axis=-1,
    )
    return out
