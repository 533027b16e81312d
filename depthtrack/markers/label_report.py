"""Figures of a labelled capture, for reports."""

from typing import Any

import numpy as np

from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.types import Array


def label_report(labelled: LabelledCapture) -> dict[str, Any]:
    """Return figures of a labelled capture as JSON values.

    Shares are 0 to 1. Keys contain the unit.
    """
    points = int(np.isfinite(labelled.capture.positions).all(axis=-1).sum())
    given = sum(int((columns >= 0).sum()) for columns in labelled.columns)
    return {
        "frames": len(labelled.capture),
        "rate_hz": labelled.capture.rate,
        "points": points,
        "labelled": given,
        "unlabelled": points - given,
        "models": {model.name: _model_report(labelled, k) for k, model in enumerate(labelled.models)},
    }


def _model_report(labelled: LabelledCapture, k: int) -> dict[str, Any]:
    measured, residuals = labelled.columns[k] >= 0, 1000 * labelled.residuals(k)
    posed = np.isfinite(labelled.poses[k]).all(axis=1)
    means = [_mean(column) for column in residuals.T]
    return {
        "markers": measured.shape[1],
        "measured_share": float(np.mean(measured)),
        "frames_with_pose": int(posed.sum()),
        "residual_mm": _mean(residuals),
        "confidence": _mean(labelled.confidence[k]),
        "residual_mm_by_marker": dict(zip(labelled.models[k].labels, means, strict=True)),
    }


def _mean(values: Array) -> float | None:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else None
