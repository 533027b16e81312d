"""What a frame changes in the state: poses, residuals, markers, and lost models."""

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.hand.compiled_kinematics import BodyPoses
from depthtrack.markers.labelling.pose_fit import determined_angles
from depthtrack.markers.labelling.prediction import residual_share, residual_spread
from depthtrack.markers.labelling.scene import Scene
from depthtrack.markers.labelling.state import LARGEST_MARGIN, LARGEST_MISFIT, FrameLabels, Settings, TrackState
from depthtrack.types import Array

NEIGHBOUR = 0.05
"""Distance within which two markers may have exchanged their points, metres."""


@compiled(nogil=True)
def keep_pose(scene: Scene, g: int, state: TrackState, pose: Array) -> None:
    """Store the pose and its change since the last frame.

    A correction is no motion: what was not determined in the last frame has no change.
    """
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
        step[6 + a] = pose[7 + a] - old[7 + a] if state.undetermined[g, a] == 0 else 0.0
    if state.loose[g] > 0:
        step[:6] = 0.0
    old[:] = pose


@compiled(nogil=True)
def keep_residuals(
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
        features = out.features[i]
        features[0], features[1] = 1.0, min(out.margin[i], LARGEST_MARGIN)
        features[2] = np.log1p(min(misfit(points[j], scene, settings, state, i, placed, bodies), LARGEST_MISFIT))
        features[3] = np.log(1.0 + state.run[i])
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
def keep_markers(points: Array, scene: Scene, g: int, settings: Settings, state: TrackState, out: FrameLabels) -> None:
    """Update position, velocity and absence of the markers, and what the visible ones determine."""
    visible = 0
    for i in range(scene.first[g], scene.first[g + 1]):
        j = out.point[i]
        if j < 0:
            state.missing[i] += 1
            state.run[i] = 0
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
        state.run[i] += 1
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
def check_lost(scene: Scene, g: int, settings: Settings, state: TrackState, out: FrameLabels) -> None:
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
def exchange_points(
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
            other = distance(x, placed[k]) ** 2 + distance(y, placed[i]) ** 2
            variance = 2 * (_spread(scene, settings, i) ** 2 + _spread(scene, settings, k) ** 2)
            ratio = min(max((kept - other) / variance, -10.0), 10.0)
            state.swap[i, k] = max(0.0, state.swap[i, k] + ratio)
            if state.swap[i, k] > settings.swap:
                state.swap[i, k] = 0.0
                out.point[i], out.point[k] = out.point[k], out.point[i]
                out.error[i], out.error[k] = distance(y, placed[i]), distance(x, placed[k])
                for r in range(3):
                    state.position[i, r], state.position[k, r] = state.position[k, r], state.position[i, r]
                    state.velocity[i, r], state.velocity[k, r] = state.velocity[k, r], state.velocity[i, r]
                    state.residual[i, r], state.residual[k, r] = 0.0, 0.0
                state.seen[i], state.seen[k] = 0, 0
                state.run[i], state.run[k] = 0, 0


@compiled(nogil=True)
def _spread(scene: Scene, settings: Settings, i: int) -> float:
    return np.sqrt(max(scene.spread[i], settings.least_spread) ** 2 + 3 * settings.noise**2)


@compiled(nogil=True)
def distance(x: Array, y: Array) -> float:
    return np.sqrt((x[0] - y[0]) ** 2 + (x[1] - y[1]) ** 2 + (x[2] - y[2]) ** 2)


@compiled(nogil=True)
def misfit(
    target: Array, scene: Scene, settings: Settings, state: TrackState, i: int, placed: Array, bodies: BodyPoses
) -> float:
    """Return the distance of a point from its usual place, in standard deviations."""
    T, e, total = bodies.T[scene.body[i]], residual_share(settings, state, i) * state.residual[i], 0.0
    for r in range(3):
        x = target[r] - placed[i, r] - (T[r, 0] * e[0] + T[r, 1] * e[1] + T[r, 2] * e[2])
        total += x * x
    return float(np.sqrt(total / (residual_spread(scene, settings, state, i) ** 2 + 3 * settings.noise**2)))
