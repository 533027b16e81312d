"""One frame of the tracking in one kernel (Maycock et al. 2015, Fig. 3).

It predicts, assigns, fits, rejects and exchanges.
"""

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.hand.compiled_kinematics import BodyPoses
from depthtrack.markers.labelling.assignment import assign
from depthtrack.markers.labelling.pose_fit import PoseFit, determined_angles, fit_pose
from depthtrack.markers.labelling.prediction import predict
from depthtrack.markers.labelling.scene import Scene, place_markers
from depthtrack.markers.labelling.state import FrameLabels, Settings, TrackState
from depthtrack.markers.labelling.state_update import (
    check_lost,
    distance,
    exchange_points,
    keep_markers,
    keep_pose,
    keep_residuals,
    misfit,
)
from depthtrack.types import Array, Index


@compiled(nogil=True)
def track_frame(points: Array, scene: Scene, settings: Settings, state: TrackState, out: FrameLabels) -> None:
    """Label the points (K, 3) of the next frame, metres, and update the state and the result.

    A model that has been failing for too long becomes inactive.
    """
    G, M = scene.rigid.shape[0], scene.body.shape[0]
    poses, placed, targets, weights = np.empty((G, 27)), np.empty((M, 3)), np.zeros((M, 3)), np.zeros(M)
    bodies = BodyPoses(np.empty((16, 3, 4)), np.empty((20, 3)), np.empty((20, 3)))
    predict(scene, settings, state, poses, placed, out)
    assign(points, scene, settings, state, out)
    out.error[:] = np.nan
    out.features[:] = np.nan
    for g in range(G):
        if not state.active[g]:
            continue
        for _ in range(2):
            _fit(points, scene, g, settings, state, out, targets, weights, poses[g], placed, bodies)
            if settings.padded or not _reject(scene, g, settings, state, out, targets, placed, bodies):
                break
        keep_pose(scene, g, state, poses[g])
        keep_residuals(points, scene, g, settings, state, out, placed, bodies)
    if not settings.padded:
        exchange_points(points, scene, settings, state, out, placed)
    for g in range(G):
        if state.active[g]:
            keep_markers(points, scene, g, settings, state, out)
            check_lost(scene, g, settings, state, out)


@compiled(nogil=True)
def track_frames(
    points: Array,
    ends: Index,
    scene: Scene,
    settings: Settings,
    state: TrackState,
    out: FrameLabels,
    begin: int,
    end: int,
    backward: bool,
    labels: Index,
    poses: Array,
    features: Array,
) -> int:
    """Track frames until a model is lost, or to the end; return the number of frames.

    points: (N, 3) the points of all frames, metres; those of frame t are `ends[t]` to `ends[t + 1] - 1`.
    begin, end: first frame, and the one after the last; backward from `end - 1` to `begin` if `backward`.
    labels, poses, features: (T, M) numbers among the N points, (T, G, 27) NaN if lost, (T, M, 4), outputs.
    """
    active = np.count_nonzero(state.active)
    for n in range(end - begin):
        t = end - 1 - n if backward else begin + n
        track_frame(points[ends[t] : ends[t + 1]], scene, settings, state, out)
        for i in range(labels.shape[1]):
            labels[t, i] = ends[t] + out.point[i] if out.point[i] >= 0 else -1
            features[t, i] = out.features[i]
        for g in range(poses.shape[1]):
            if state.active[g]:
                poses[t, g] = state.pose[g]
            else:
                poses[t, g] = np.nan
        if np.count_nonzero(state.active) < active:
            return n + 1
    return end - begin


@compiled(nogil=True)
def _fit(
    points: Array,
    scene: Scene,
    g: int,
    settings: Settings,
    state: TrackState,
    out: FrameLabels,
    targets: Array,
    weights: Array,
    pose: Array,
    placed: Array,
    bodies: BodyPoses,
) -> None:
    """Fit model g to its points; a second fit lowers the weights of outliers."""
    frozen = np.zeros(20, np.bool_)
    fit = PoseFit(settings.iterations, settings.damping, settings.avoid_limits)
    visible = 0
    for i in range(scene.first[g], scene.first[g + 1]):
        weights[i] = 0.0
        if out.point[i] >= 0:
            weights[i] = 1.0
            targets[i] = points[out.point[i]]
            visible += 1
    if settings.freeze:
        determined_angles(scene, g, out.point, frozen)
        for a in range(20):
            frozen[a] = not frozen[a]
            if frozen[a]:
                pose[7 + a] = state.pose[g, 7 + a]
    if visible == 0:
        pose[:] = state.pose[g]
    else:
        fit_pose(scene, g, fit, targets, weights, frozen, pose, state.slope[g], bodies)
    place_markers(scene, g, pose, bodies, placed)
    outliers = False
    for i in range(scene.first[g], scene.first[g + 1]):
        if out.point[i] >= 0:
            out.error[i] = distance(targets[i], placed[i])
            unusual = misfit(targets[i], scene, settings, state, i, placed, bodies)
            share = unusual / settings.robust if settings.robust > 0 else 0.0
            if share > 1.0:
                outliers = True
            weights[i] = 1 / (1 + share * share) ** 2
    if outliers:
        fit_pose(scene, g, fit, targets, weights, frozen, pose, state.slope[g], bodies)
        place_markers(scene, g, pose, bodies, placed)
        for i in range(scene.first[g], scene.first[g + 1]):
            if out.point[i] >= 0:
                out.error[i] = distance(targets[i], placed[i])


@compiled(nogil=True)
def _reject(
    scene: Scene,
    g: int,
    settings: Settings,
    state: TrackState,
    out: FrameLabels,
    targets: Array,
    placed: Array,
    bodies: BodyPoses,
) -> bool:
    """Remove labels whose point does not fit the model; return whether there was one.

    The paper's distance threshold: a ghost would pull the model to a wrong pose.
    """
    found = False
    for i in range(scene.first[g], scene.first[g + 1]):
        if out.point[i] < 0:
            continue
        new = state.missing[i] > 0
        unusual = misfit(targets[i], scene, settings, state, i, placed, bodies)
        if unusual <= (settings.reject_new if new else settings.reject):
            state.outlying[i] = 0
        elif new or state.outlying[i] >= settings.patience:
            out.point[i], out.error[i], state.outlying[i], found = -1, np.nan, 0, True
        else:
            state.outlying[i] += 1
    return found
