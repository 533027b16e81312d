"""Errors of visible points and of those that only the prior determines, beside their spread."""

from dataclasses import replace

import numpy as np

from depthtrack.evaluation.metrics.metric import Metric
from depthtrack.evaluation.metrics.points import PointErrors
from depthtrack.hand.kinematics import KEYPOINT_NAMES
from depthtrack.types import Array, Mask


def visible_and_hidden(errors: PointErrors, visible: Mask) -> tuple[Metric, Metric]:
    """Return the mean errors of the visible and of the hidden points of each frame, mm.

    visible: (T, P).
    """
    shown, hidden = (
        replace(errors, metric=f"{name}_{errors.metric}", mm=np.where(part, errors.mm, np.nan))
        for name, part in (("visible", visible), ("hidden", ~visible))
    )
    return shown.mean(), hidden.mean()


def within_spread(errors: PointErrors, spread: Array, visible: Mask) -> tuple[Metric, Metric]:
    """Return the shares of visible and of hidden points with errors below their spread.

    There is one of each per frame.

    spread: (T, 21) of the keypoints, metres, see `RunRow`; NaN if unknown. It should hold about 68 % of the errors.
    visible: (T, P).
    """
    limit = 1000 * spread[:, [KEYPOINT_NAMES.index(name) for name in errors.names]]
    known = np.isfinite(errors.mm) & np.isfinite(limit)
    shares = []
    for part in (visible & known, ~visible & known):
        count = part.sum(axis=1)
        within = (part & (errors.mm < limit)).sum(axis=1)
        shares.append(np.where(count > 0, within / np.maximum(count, 1), np.nan))
    shown, hidden = shares
    return Metric("visible_within_spread", "", shown), Metric("hidden_within_spread", "", hidden)
