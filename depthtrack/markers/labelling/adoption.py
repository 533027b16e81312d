"""Adoption of long tracklets without a label, tested by a fit of the pose to them.

A joint that moved no visible marker for long may have turned far. Its markers are then not where the model expects
them, but a fit finds an angle at which they fit.
"""

import numpy as np

from depthtrack.markers.labelling.capture_fit import ExpectedFrames, FittedFrames, fit_capture
from depthtrack.markers.labelling.packed import PackedPoints
from depthtrack.markers.labelling.scene import Scene
from depthtrack.markers.labelling.state import Settings
from depthtrack.types import Array, Index

REACH = 0.07
"""Largest distance of a tracklet from where its marker is expected, metres."""
SAMPLES = 12
"""Frames of a tracklet that are fitted."""


def adopt_tracklets(
    points: PackedPoints,
    tracklet: Index,
    labels: Index,
    fitted: FittedFrames,
    expected: ExpectedFrames,
    scene: Scene,
    settings: Settings,
    shortest: int,
) -> Index:
    """Return the labels with those of tracklets added that fit a marker without a point.

    shortest: frames of a tracklet, at least.
    """
    out = labels.copy()
    labelled = np.zeros(len(points.position), np.bool_)
    labelled[labels[labels >= 0]] = True
    lengths = np.bincount(tracklet)
    free = np.bincount(tracklet, weights=labelled) == 0
    members = np.argsort(tracklet, kind="stable")
    starts = np.concatenate([[0], np.cumsum(lengths)])
    for k in sorted(np.flatnonzero(free & (lengths >= shortest)), key=lambda k: -lengths[k]):
        numbers = members[starts[k] : starts[k + 1]]
        frames = points.frame[numbers]
        near = np.linalg.norm(expected.position[frames] - points.position[numbers][:, None], axis=-1)
        candidates = np.flatnonzero((out[frames] < 0).all(axis=0) & (np.median(near, axis=0) < REACH))
        misfits = [_misfit(points.position, numbers, frames, out, int(i), fitted, scene, settings) for i in candidates]
        if misfits and min(misfits) < settings.reject_new:
            out[frames, candidates[int(np.argmin(misfits))]] = numbers
    return out


def _misfit(
    position: Array,
    numbers: Index,
    frames: Index,
    labels: Index,
    marker: int,
    fitted: FittedFrames,
    scene: Scene,
    settings: Settings,
) -> float:
    """Return the misfit of a model with a tracklet as the marker, in standard deviations."""
    chosen = np.unique(np.linspace(0, len(numbers) - 1, SAMPLES).round().astype(int))
    trial = labels[frames[chosen]].copy()
    trial[:, marker] = numbers[chosen]
    fit = fit_capture(position, trial, scene, settings, fitted.poses[frames[chosen]], fitted)
    g = scene.model_of[marker]
    rows = slice(scene.first[g], scene.first[g + 1])
    spread = np.sqrt(fitted.scatter[rows] ** 2 + 3 * settings.noise**2)
    unusual = np.linalg.norm(fit.residuals[:, rows] - fitted.usual[rows], axis=-1) / spread
    unusual[np.isnan(unusual)] = 0.0
    return float(np.max(np.quantile(unusual, 0.75, axis=0), initial=0.0))
