"""Residual correction: where a marker sits beside its place on the model, over time."""

import numpy as np

from depthtrack.hand.kinematics import MOVES
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.types import Array, Mask


def marker_offsets(model: MarkerModel, poses: Array, measured: Array, usable: Mask, width: int) -> Array:
    """Return the place (T, M, 3) of each marker in the frame of its body over time, metres.

    poses: (T, 27) capture frame, finite where `usable`.
    measured: (T, M, 3) metres, capture frame; finite where `usable`.
    usable: (T, M) whether a frame shows where a marker sits.
    width: frames over which a place is averaged.

    Between usable frames the place moves linearly. A marker without any keeps the offset of the model.
    """
    T = model.kinematics.transforms(poses)[:, model.bodies]
    seen = np.einsum("tmji,tmj->tmi", T[..., :3, :3], measured - T[..., :3, 3])
    offsets, frames = np.tile(model.offsets, (len(poses), 1, 1)), np.arange(len(poses))
    box = np.ones(2 * (width // 2) + 1)
    for m in range(len(model.labels)):
        weight = usable[:, m].astype(np.float64)
        known = np.flatnonzero(usable[:, m])
        if len(known) == 0:
            continue
        counts = np.convolve(weight, box, "same")[known]
        for i in range(3):
            sums = np.convolve(np.where(usable[:, m], seen[:, m, i], 0.0), box, "same")[known]
            offsets[:, m, i] = np.interp(frames, known, sums / counts)
    return offsets


def whole_chains(model: MarkerModel, visible: Mask) -> Mask:
    """Return whether all other markers of a marker's finger and palm are visible with it (T, M).

    Markers that are missing in most frames are not waited for.
    """
    frequent = visible.mean(axis=0) >= 0.5
    moves = MOVES[model.bodies]
    palm = ~moves.any(axis=1)
    whole = np.zeros_like(visible)
    for m in range(visible.shape[1]):
        chain = palm | (moves & moves[m]).any(axis=1)
        whole[:, m] = visible[:, chain & frequent].all(axis=1) & visible[:, m]
    return whole
