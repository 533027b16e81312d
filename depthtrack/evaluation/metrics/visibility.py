"""Errors of visible points, and of those that only the prior determines."""

from dataclasses import replace

import numpy as np

from depthtrack.evaluation.metrics.metric import Metric
from depthtrack.evaluation.metrics.points import PointErrors
from depthtrack.types import Mask


def visible_and_hidden(errors: PointErrors, visible: Mask) -> tuple[Metric, Metric]:
    """Return the mean errors of the visible and of the hidden points of each frame, mm.

    visible: (T, P).
    """
    shown, hidden = (
        replace(errors, metric=f"{name}_{errors.metric}", mm=np.where(part, errors.mm, np.nan))
        for name, part in (("visible", visible), ("hidden", ~visible))
    )
    return shown.mean(), hidden.mean()
