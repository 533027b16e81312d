"""Metrics with their units, one file per family; arrays have one row per frame.

A row is NaN if the frame has no pose, no ground truth, or no observed hand.
"""

from depthtrack.evaluation.metrics.jitter import added_jitter, jitter
from depthtrack.evaluation.metrics.losses import Loss, Losses, find_losses
from depthtrack.evaluation.metrics.metric import Metric
from depthtrack.evaluation.metrics.offsets import without_offsets
from depthtrack.evaluation.metrics.points import (
    PointErrors,
    angle_error,
    endpoint_error,
    endpoint_errors,
    joint_errors,
)
from depthtrack.evaluation.metrics.reliability import Reliability
from depthtrack.evaluation.metrics.residuals import Residuals, e2d, e3d, silhouette_iou
from depthtrack.evaluation.metrics.success import SuccessCurve
from depthtrack.evaluation.metrics.timing import frame_time, stage_times
from depthtrack.evaluation.metrics.visibility import visible_and_hidden, within_spread

__all__ = [
    "Loss",
    "Losses",
    "Metric",
    "PointErrors",
    "Reliability",
    "Residuals",
    "SuccessCurve",
    "added_jitter",
    "angle_error",
    "e2d",
    "e3d",
    "endpoint_error",
    "endpoint_errors",
    "find_losses",
    "frame_time",
    "jitter",
    "joint_errors",
    "silhouette_iou",
    "stage_times",
    "visible_and_hidden",
    "within_spread",
    "without_offsets",
]
