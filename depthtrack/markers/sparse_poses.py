"""Poses of hands with few markers: likely postures decide the other joints.

Schroeder et al. 2015, Sec. 3, after the labels are known.
"""

from dataclasses import replace

import numpy as np

from depthtrack.hand.synergies import Synergies
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.layout.reconstruction import ReconstructionOptions, reconstruct
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.types import Array

RECORDED = ReconstructionOptions(residual=0.002)
"""Reconstruction of a recorded hand, whose skin slides; chosen on a glove of 13 markers."""
_FEWEST = 3
"""Markers of the first frame that is reconstructed."""


def is_sparse(model: MarkerModel) -> bool:
    """Return whether the markers of a hand leave joints undetermined.

    The two outer angles of a finger need a marker on its outer half, and its two inner ones another.
    """
    if model.is_rigid:
        return False
    fingers = (np.asarray(model.bodies)[np.asarray(model.bodies) > 0] - 1) // 3
    return bool(np.bincount(fingers, minlength=5).min() < 2)


def with_likely_postures(labelled: LabelledCapture) -> LabelledCapture:
    """Return the capture with sparse hands reconstructed by the synergies of their models.

    Hands without synergies keep their poses. Frames in which a hand was lost stay so.
    """
    poses = {
        k: _reconstructed(model, labelled.positions(k), labelled.poses[k], model.synergies)
        for k, model in enumerate(labelled.models)
        if model.synergies is not None and is_sparse(model)
    }
    if not poses:
        return labelled
    return replace(labelled, poses=tuple(poses.get(k, each) for k, each in enumerate(labelled.poses)))


def _reconstructed(model: MarkerModel, positions: Array, poses: Array, synergies: Synergies) -> Array:
    known = np.isfinite(poses).all(axis=1)
    shown = known & (np.isfinite(positions).all(axis=-1).sum(axis=1) >= _FEWEST)
    if not shown.any():
        return poses
    used = np.flatnonzero(known & (np.arange(len(poses)) >= np.argmax(shown)))
    out = poses.copy()
    options = replace(RECORDED, components=min(RECORDED.components, len(model.labels)))
    out[used] = reconstruct(model, positions[used], synergies, options)
    return out
