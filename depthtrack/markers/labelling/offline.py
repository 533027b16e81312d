"""Offline labelling: both directions, then tracklets by the evidence of all their frames."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.labelling.adoption import adopt_tracklets
from depthtrack.markers.labelling.capture_fit import expect_markers, fit_capture
from depthtrack.markers.labelling.confidence import OFFLINE, ONLINE, confidence, offline_features
from depthtrack.markers.labelling.evidence import assign_tracklets, contested, label_points, tracklet_evidence
from depthtrack.markers.labelling.options import LabellingOptions, OfflineOptions
from depthtrack.markers.labelling.packed import PackedPoints
from depthtrack.markers.labelling.scene import Scene
from depthtrack.markers.labelling.splitting import split_tracklets
from depthtrack.markers.labelling.state import FrameLabels, Settings, TrackState
from depthtrack.markers.labelling.step import track_frames
from depthtrack.markers.labelling.tracker import Starter, restart
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
    if not chosen.offline.use:
        online = track_online(points, models, scene, settings, starts, starter, frame)
        sure = confidence(online.features, ONLINE)
        return _labelled(capture, points, models, scene, online.labels, online.poses, sure)
    forward, backward = in_both_directions(points, models, scene, settings, starts, starter, frame)
    links = LinkSettings.of(chosen, capture.rate)
    found = resolve(points, scene, settings, chosen.offline, links, forward, backward)
    return _labelled(capture, points, models, scene, found.labels, found.poses, confidence(found.features, OFFLINE))


class Pass(NamedTuple):
    """Labels (T, M), poses (T, G, 27) and features (T, M, 4) of the tracker in one direction."""

    labels: Index
    poses: Array
    features: Array


def track_online(
    points: PackedPoints,
    models: Sequence[MarkerModel],
    scene: Scene,
    settings: Settings,
    starts: Sequence[Array | None] | None,
    starter: Starter | None,
    frame: int,
) -> Pass:
    """Track from a frame to the end, and from there backward to the first frame."""
    after = track(points, models, scene, settings, starts, starter, frame, len(points.ends) - 1)
    before = track(points, models, scene, settings, starts, starter, 0, frame, backward=True)
    return Pass(*(np.concatenate([a[:frame], b[frame:]]) for a, b in zip(before, after, strict=True)))


def in_both_directions(
    points: PackedPoints,
    models: Sequence[MarkerModel],
    scene: Scene,
    settings: Settings,
    starts: Sequence[Array | None] | None,
    starter: Starter | None,
    frame: int,
) -> tuple[Pass, Pass]:
    """Track the whole capture forward and backward, from starts in one frame."""
    last = len(points.ends) - 1
    forward = track(points, models, scene, settings, starts, starter, frame, last)
    backward = track(points, models, scene, settings, _known(forward.poses[-1]), starter, 0, last, backward=True)
    if frame > 0:
        forward = track(points, models, scene, settings, _known(backward.poses[0]), starter, 0, last)
    return forward, backward


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
    out = Pass(np.full((T, M), -1, np.int64), np.full((T, G, 27), np.nan), np.full((T, M, 4), np.nan))
    state, frame = TrackState.empty(scene), FrameLabels.empty(M)
    for g, pose in enumerate(starts or ()):
        if pose is not None:
            state.start(scene, g, pose)
    while begin < end:
        count = end - begin
        if starter is not None and not state.active.all():
            t = end - 1 if backward else begin
            restart(points.position[points.ends[t] : points.ends[t + 1]], scene, models, state, starter)
            count = count if state.active.all() else min(settings.retry_frames, count)
        first, last = (end - count, end) if backward else (begin, begin + count)
        run = track_frames(points.position, points.ends, scene, settings, state, frame, first, last, backward, *out)
        begin, end = (begin, end - run) if backward else (begin + run, end)
    return out


class Resolved(NamedTuple):
    """Labels (T, M), poses (T, G, 27), and features (T, M, 6) of their confidence."""

    labels: Index
    poses: Array
    features: Array


def resolve(
    points: PackedPoints,
    scene: Scene,
    settings: Settings,
    options: OfflineOptions,
    links: LinkSettings,
    forward: Pass,
    backward: Pass,
) -> Resolved:
    """Assign tracklets to markers and fit poses in turn.

    The first poses are those of the labels on which both directions agree.

    forward, backward: the tracker in both directions.
    """
    tracklet = make_tracklets(points, links)
    labels = np.where(forward.labels == backward.labels, forward.labels, -1)
    starting = np.where(np.isnan(forward.poses), backward.poses, forward.poses)
    fitted = fit_capture(points.position, labels, scene, settings, starting)
    shortest = round(options.adopt * links.rate)
    for _ in range(options.rounds):
        expected = expect_markers(fitted, scene, settings)
        tracklet = split_tracklets(points, tracklet, expected, settings, options.split)
        evidence = tracklet_evidence(points, tracklet, expected, settings)
        rivals = contested(points, tracklet, labels, expected, settings.clutter)
        if rivals.any():
            kept = np.where((labels >= 0) & ~rivals[tracklet[labels]], labels, -1)
            without = fit_capture(points.position, kept, scene, settings, fitted.poses, fitted)
            fair = tracklet_evidence(points, tracklet, expect_markers(without, scene, settings), settings)
            undecided = rivals | ~np.isin(np.arange(len(rivals)), tracklet[labels[labels >= 0]])
            evidence = np.where(undecided[:, None], fair, evidence)
        new = label_points(points, tracklet, assign_tracklets(points, tracklet, evidence), labels.shape[1])
        new = adopt_tracklets(points, tracklet, new, fitted, expected, scene, settings, shortest)
        settled = np.array_equal(new, labels)
        labels = new
        fitted = fit_capture(points.position, labels, scene, settings, fitted.poses, fitted)
        if settled:
            break
    features = offline_features(
        points, tracklet, labels, evidence, rivals, (forward.labels, backward.labels), fitted, settings
    )
    return Resolved(labels, fitted.poses, features)


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
    sure: Array,
) -> LabelledCapture:
    columns = points.columns(labels)
    parts = [slice(a, b) for a, b in zip(scene.first[:-1], scene.first[1:], strict=True)]
    sure = np.where(labels >= 0, sure, np.nan)
    return LabelledCapture(
        capture,
        tuple(models),
        tuple(columns[:, part] for part in parts),
        tuple(poses[:, g].copy() for g in range(len(parts))),
        tuple(sure[:, part] for part in parts),
    )
