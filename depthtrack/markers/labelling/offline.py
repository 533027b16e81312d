"""Offline labelling: both directions, then tracklets by the evidence of all their frames."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.labelling.adoption import adopt_tracklets
from depthtrack.markers.labelling.capture_fit import expect_markers, fit_capture
from depthtrack.markers.labelling.evidence import assign_tracklets, contested, label_points, tracklet_evidence
from depthtrack.markers.labelling.options import LabellingOptions
from depthtrack.markers.labelling.packed import PackedPoints
from depthtrack.markers.labelling.scene import Scene
from depthtrack.markers.labelling.splitting import split_tracklets
from depthtrack.markers.labelling.state import FrameLabels, Settings, TrackState
from depthtrack.markers.labelling.step import track_frames
from depthtrack.markers.labelling.tracker import Starter
from depthtrack.markers.labelling.tracklets import LinkSettings, make_tracklets
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.types import Array, Index


def label_capture(
    capture: MarkerCapture,
    models: Sequence[MarkerModel],
    options: LabellingOptions | None = None,
    starts: Sequence[Array | None] | None = None,
    starter: Starter | None = None,
    frame: int = 0,
) -> LabelledCapture:
    """Return the capture with its points assigned to the markers of models.

    starts: pose (27,) of each model in one frame; None for one that is not known.
    frame: index of that frame; the online method labels the frames before it backward.
    starter: initialisation of models that are not tracked; None: they stay lost.
    """
    chosen = options or LabellingOptions()
    points, scene, settings = PackedPoints.of(capture), Scene.of(models), Settings.of(chosen, capture.rate)
    last = len(capture)
    forward = track(points, models, scene, settings, starts, starter, frame, last)
    if not chosen.offline.use:
        before = track(points, models, scene, settings, starts, starter, 0, frame, backward=True)
        labels = np.where(np.arange(last)[:, None] < frame, before.labels, forward.labels)
        poses = np.where(np.arange(last)[:, None, None] < frame, before.poses, forward.poses)
        return _labelled(capture, points, models, scene, labels, poses, np.ones(labels.shape))
    backward = track(points, models, scene, settings, _known(forward.poses[-1]), starter, 0, last, backward=True)
    if frame > 0:
        forward = track(points, models, scene, settings, _known(backward.poses[0]), starter, 0, last)
    starting = np.where(np.isnan(forward.poses), backward.poses, forward.poses)
    tracklet = make_tracklets(points, LinkSettings.of(chosen, capture.rate))
    labels = np.where(forward.labels == backward.labels, forward.labels, -1)
    fitted = fit_capture(points.position, labels, scene, settings, starting)
    shortest = round(chosen.offline.adopt * capture.rate)
    for _ in range(chosen.offline.rounds):
        expected = expect_markers(fitted, scene, settings)
        tracklet = split_tracklets(points, tracklet, expected, settings, chosen.offline.split)
        evidence = tracklet_evidence(points, tracklet, expected, settings)
        open_to = contested(points, tracklet, labels, expected, settings.clutter)
        if open_to.any():
            kept = np.where((labels >= 0) & ~open_to[tracklet[labels]], labels, -1)
            without = fit_capture(points.position, kept, scene, settings, fitted.poses, fitted)
            fair = tracklet_evidence(points, tracklet, expect_markers(without, scene, settings), settings)
            undecided = open_to | ~np.isin(np.arange(len(open_to)), tracklet[labels[labels >= 0]])
            evidence = np.where(undecided[:, None], fair, evidence)
        new = label_points(points, tracklet, assign_tracklets(points, tracklet, evidence), labels.shape[1])
        new = adopt_tracklets(points, tracklet, new, fitted, expected, scene, settings, shortest)
        if np.array_equal(new, labels):
            break
        labels = new
        fitted = fit_capture(points.position, labels, scene, settings, fitted.poses, fitted)
    return _labelled(capture, points, models, scene, labels, fitted.poses, np.ones(labels.shape))


class Pass(NamedTuple):
    """Labels (T, M), poses (T, G, 27) and margins (T, M) of the tracker in one direction."""

    labels: Index
    poses: Array
    margins: Array


def track(
    points: PackedPoints,
    models: Sequence[MarkerModel],
    scene: Scene,
    settings: Settings,
    starts: Sequence[Array | None] | None,
    starter: Starter | None,
    begin: int,
    end: int,
    backward: bool = False,
) -> Pass:
    """Track frames in one direction; lost models start again where the starter finds them."""
    T, M, G = len(points.ends) - 1, len(scene.body), len(scene.rigid)
    out = Pass(np.full((T, M), -1, np.int64), np.full((T, G, 27), np.nan), np.full((T, M), np.nan))
    state, frame = TrackState.empty(scene), FrameLabels.empty(M)
    for g, pose in enumerate(starts or ()):
        if pose is not None:
            state.start(scene, g, pose)
    while begin < end:
        n = track_frames(points.position, points.ends, scene, settings, state, frame, begin, end, backward, *out)
        begin, end = (begin, end - n) if backward else (begin + n, end)
    return out


def _known(poses: Array) -> list[Array | None]:
    """Return the poses (G, 27) of a frame; None for a model that is not tracked."""
    return [pose if np.isfinite(pose[0]) else None for pose in poses]


def _labelled(
    capture: MarkerCapture,
    points: PackedPoints,
    models: Sequence[MarkerModel],
    scene: Scene,
    labels: Index,
    poses: Array,
    confidence: Array,
) -> LabelledCapture:
    columns = points.columns(labels)
    parts = [slice(a, b) for a, b in zip(scene.first[:-1], scene.first[1:], strict=True)]
    confidence = np.where(labels >= 0, confidence, np.nan)
    return LabelledCapture(
        capture,
        tuple(models),
        tuple(columns[:, part] for part in parts),
        tuple(poses[:, g].copy() for g in range(len(parts))),
        tuple(confidence[:, part] for part in parts),
    )
