"""One frame of the tracking in one kernel (Maycock et al. 2015, Fig. 3).

It predicts, assigns, fits, rejects and exchanges.
"""

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.hand.compiled_kinematics import BodyPoses
from depthtrack.markers.labelling.assignment import assign
from depthtrack.markers.labelling.pose_fit import PoseFit, fit_pose
from depthtrack.markers.labelling.prediction import predict, residual_spread
from depthtrack.markers.labelling.scene import Scene, place_markers
from depthtrack.markers.labelling.state import FrameLabels, Settings, TrackState
from depthtrack.types import Array, Index, Mask

NEIGHBOUR = 0.05
"""Distance within which two markers may have exchanged their points, metres."""


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
    for g in range(G):
        if not state.active[g]:
            continue
        for _ in range(2):
            _fit(points, scene, g, settings, state, out, targets, weights, poses[g], placed, bodies)
            if settings.padded or not _reject(scene, g, settings, state, out, targets, placed, bodies):
                break
        _keep_pose(scene, g, state, poses[g])
        _keep_residuals(points, scene, g, settings, state, out, placed, bodies)
    if not settings.padded:
        _exchange(points, scene, settings, state, out, placed)
    for g in range(G):
        if state.active[g]:
            _keep_markers(points, scene, g, settings, state, out)
            _check_lost(scene, g, settings, state, out)


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
    margins: Array,
) -> int:
    """Track frames until a model is lost, or to the end; return the number of frames.

    points: (N, 3) the points of all frames, metres; those of frame t are `ends[t]` to `ends[t + 1] - 1`.
    begin, end: first frame, and the one after the last; backward from `end - 1` to `begin` if `backward`.
    labels, poses, margins: (T, M) numbers among the N points, (T, G, 27) NaN if lost, (T, M), outputs.
    """
    active = np.count_nonzero(state.active)
    for n in range(end - begin):
        t = end - 1 - n if backward else begin + n
        track_frame(points[ends[t] : ends[t + 1]], scene, settings, state, out)
        for i in range(labels.shape[1]):
            labels[t, i] = ends[t] + out.point[i] if out.point[i] >= 0 else -1
            margins[t, i] = out.margin[i]
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
            out.error[i] = _distance(targets[i], placed[i])
            unusual = _unusual(targets[i], scene, settings, state, i, placed, bodies)
            share = unusual / settings.robust if settings.robust > 0 else 0.0
            if share > 1.0:
                outliers = True
            weights[i] = 1 / (1 + share * share) ** 2
    if outliers:
        fit_pose(scene, g, fit, targets, weights, frozen, pose, state.slope[g], bodies)
        place_markers(scene, g, pose, bodies, placed)
        for i in range(scene.first[g], scene.first[g + 1]):
            if out.point[i] >= 0:
                out.error[i] = _distance(targets[i], placed[i])


@compiled(nogil=True)
def determined_angles(scene: Scene, g: int, point: Index, out: Mask) -> None:
    """Write whether each angle (20,) of model g moves a marker that has a point."""
    out[:] = False
    for i in range(scene.first[g], scene.first[g + 1]):
        if point[i] >= 0:
            for a in range(20):
                out[a] |= scene.moves[i, a]


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
        unusual = _unusual(targets[i], scene, settings, state, i, placed, bodies)
        if unusual <= (settings.reject_new if new else settings.reject):
            state.outlying[i] = 0
        elif new or state.outlying[i] >= settings.patience:
            out.point[i], out.error[i], state.outlying[i], found = -1, np.nan, 0, True
        else:
            state.outlying[i] += 1
    return found


@compiled(nogil=True)
def _keep_pose(scene: Scene, g: int, state: TrackState, pose: Array) -> None:
    """Store the pose and its change since the last frame."""
    old, step = state.pose[g], state.step[g]
    for r in range(3):
        step[r] = pose[r] - old[r]
    # The rotation vector of q conj(p), to second order in the small turn.
    w, x, y, z = pose[3], pose[4], pose[5], pose[6]
    a, b, c, d = old[3], -old[4], -old[5], -old[6]
    real = w * a - x * b - y * c - z * d
    sign = 2.0 if real >= 0 else -2.0
    step[3] = sign * (w * b + x * a + y * d - z * c)
    step[4] = sign * (w * c - x * d + y * a + z * b)
    step[5] = sign * (w * d + x * c - y * b + z * a)
    for a in range(20):
        step[6 + a] = pose[7 + a] - old[7 + a]
    old[:] = pose


@compiled(nogil=True)
def _keep_residuals(
    points: Array,
    scene: Scene,
    g: int,
    settings: Settings,
    state: TrackState,
    out: FrameLabels,
    placed: Array,
    bodies: BodyPoses,
) -> None:
    """Update the residual of each visible marker in the frame of its body."""
    total, count = 0.0, 0
    for i in range(scene.first[g], scene.first[g + 1]):
        j = out.point[i]
        if j < 0:
            continue
        total += out.error[i]
        count += 1
        T, e = bodies.T[scene.body[i]], state.residual[i]
        gain = max(settings.residual_gain, 1 / (1.0 + state.seen[i]))
        length = 0.0
        for r in range(3):
            new = 0.0
            for k in range(3):
                new += T[k, r] * (points[j, k] - placed[i, k])
            e[r] += gain * (new - e[r])
            length += e[r] * e[r]
        longest = 3 * _spread(scene, settings, i)
        if length > longest * longest:
            for r in range(3):
                e[r] *= longest / np.sqrt(length)
    if count > 0:
        state.error[g] += 0.1 * (total / count - state.error[g])


@compiled(nogil=True)
def _exchange(
    points: Array, scene: Scene, settings: Settings, state: TrackState, out: FrameLabels, placed: Array
) -> None:
    """Exchange the points of two markers once the evidence of many frames says so."""
    M = out.point.shape[0]
    for i in range(M):
        if out.point[i] < 0:
            continue
        x = points[out.point[i]]
        for k in range(i + 1, M):
            if out.point[k] < 0:
                continue
            y = points[out.point[k]]
            if abs(x[0] - y[0]) > NEIGHBOUR or abs(x[1] - y[1]) > NEIGHBOUR or abs(x[2] - y[2]) > NEIGHBOUR:
                state.swap[i, k] = 0.0
                continue
            kept = out.error[i] ** 2 + out.error[k] ** 2
            other = _distance(x, placed[k]) ** 2 + _distance(y, placed[i]) ** 2
            variance = 2 * (_spread(scene, settings, i) ** 2 + _spread(scene, settings, k) ** 2)
            ratio = min(max((kept - other) / variance, -10.0), 10.0)
            state.swap[i, k] = max(0.0, state.swap[i, k] + ratio)
            if state.swap[i, k] > settings.swap:
                state.swap[i, k] = 0.0
                out.point[i], out.point[k] = out.point[k], out.point[i]
                out.error[i], out.error[k] = _distance(y, placed[i]), _distance(x, placed[k])
                for r in range(3):
                    state.position[i, r], state.position[k, r] = state.position[k, r], state.position[i, r]
                    state.velocity[i, r], state.velocity[k, r] = state.velocity[k, r], state.velocity[i, r]
                    state.residual[i, r], state.residual[k, r] = 0.0, 0.0
                state.seen[i], state.seen[k] = 0, 0


@compiled(nogil=True)
def _keep_markers(points: Array, scene: Scene, g: int, settings: Settings, state: TrackState, out: FrameLabels) -> None:
    """Update position, velocity and absence of the markers, and what the visible ones determine."""
    visible = 0
    for i in range(scene.first[g], scene.first[g + 1]):
        j = out.point[i]
        if j < 0:
            state.missing[i] += 1
            state.outlying[i] = 0
            continue
        visible += 1
        for r in range(3):
            if state.missing[i] == 0:
                state.velocity[i, r] += settings.velocity_gain * (
                    points[j, r] - state.position[i, r] - state.velocity[i, r]
                )
            else:
                state.velocity[i, r] = _model_velocity(state, g, points[j], r)
            state.position[i, r] = points[j, r]
        state.missing[i] = 0
        state.seen[i] += 1
    determined = np.zeros(20, np.bool_)
    determined_angles(scene, g, out.point, determined)
    for a in range(20):
        state.undetermined[g, a] = 0 if determined[a] else state.undetermined[g, a] + 1
        if not determined[a]:
            state.step[g, 6 + a] = 0.0
    state.loose[g] = 0 if visible >= 3 else state.loose[g] + 1
    if visible < 3:
        state.step[g] *= 0.8


@compiled(nogil=True)
def _model_velocity(state: TrackState, g: int, point: Array, r: int) -> float:
    """Return coordinate r of the velocity of a point of the palm, m/frame."""
    s, p = state.step[g], state.pose[g]
    i, k = (r + 1) % 3, (r + 2) % 3
    return s[r] + s[3 + i] * (point[k] - p[k]) - s[3 + k] * (point[i] - p[i])


@compiled(nogil=True)
def _check_lost(scene: Scene, g: int, settings: Settings, state: TrackState, out: FrameLabels) -> None:
    """Make a model inactive that has had too few labels or too large residuals for too long."""
    count = scene.first[g + 1] - scene.first[g]
    labelled = 0
    for i in range(scene.first[g], scene.first[g + 1]):
        labelled += out.point[i] >= 0
    if labelled < settings.least_share * count or state.error[g] > settings.largest_error:
        state.failing[g] += 1
        if state.failing[g] >= settings.lost_frames:
            state.active[g] = False
    else:
        state.failing[g] = 0


@compiled(nogil=True)
def _unusual(
    target: Array, scene: Scene, settings: Settings, state: TrackState, i: int, placed: Array, bodies: BodyPoses
) -> float:
    """Return the distance of a point from its usual place, in standard deviations."""
    T, e, total = bodies.T[scene.body[i]], state.residual[i], 0.0
    for r in range(3):
        x = target[r] - placed[i, r] - (T[r, 0] * e[0] + T[r, 1] * e[1] + T[r, 2] * e[2])
        total += x * x
    return float(np.sqrt(total / (residual_spread(scene, settings, state, i) ** 2 + 3 * settings.noise**2)))


@compiled(nogil=True)
def _spread(scene: Scene, settings: Settings, i: int) -> float:
    return np.sqrt(max(scene.spread[i], settings.least_spread) ** 2 + 3 * settings.noise**2)


@compiled(nogil=True)
def _distance(x: Array, y: Array) -> float:
    return np.sqrt((x[0] - y[0]) ** 2 + (x[1] - y[1]) ** 2 + (x[2] - y[2]) ** 2)
