"""Poses of all frames from labels, and where they put the markers that have no point."""

from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.geometry.rotations import normalised
from depthtrack.hand.compiled_kinematics import BodyPoses
from depthtrack.markers.labelling.pose_fit import PoseFit, determined_angles, fit_pose
from depthtrack.markers.labelling.prediction import model_precision
from depthtrack.markers.labelling.scene import Scene, place_markers
from depthtrack.markers.labelling.state import Settings
from depthtrack.types import Array, Index, Mask


class FittedFrames(NamedTuple):
    """G models with M markers in T frames.

    poses: (T, G, 27) capture frame; NaN where a model has no start.
    determined: (T, G, 20) whether each angle moves a visible marker.
    loose: (T, G) whether fewer than three markers are visible.
    residuals: (T, M, 3) of the visible markers in the frames of their bodies, metres; NaN if missing.
    usual: (M, 3) median of those, metres.
    scatter: (M,) standard deviation of them about it in one coordinate, metres.
    """

    poses: Array
    determined: Mask
    loose: Mask
    residuals: Array
    usual: Array
    scatter: Array


def fit_capture(
    positions: Array, labels: Index, scene: Scene, settings: Settings, starts: Array, last: FittedFrames | None = None
) -> FittedFrames:
    """Return the poses that fit the labelled points.

    Angles that move no visible marker are interpolated in time.

    positions: (N, 3) metres.
    labels: (T, M) numbers of points; -1 for a missing marker.
    starts: (T, G, 27) poses near the solution; NaN where a model is not tracked.
    last: an earlier fit, whose usual residuals say which points are outliers.
    """
    T, G = starts.shape[:2]
    poses = np.ascontiguousarray(starts).copy()
    determined, loose = np.zeros((T, G, 20), np.bool_), np.zeros((T, G), np.bool_)
    residuals = np.full((*labels.shape, 3), np.nan)
    M = labels.shape[1]
    usual = np.zeros((M, 3)) if last is None else last.usual
    scatter = np.maximum(scene.spread, settings.least_spread) if last is None else last.scatter
    _fit_frames(positions, labels, scene, settings, poses, usual, scatter, determined, loose, residuals)
    for g in range(G):
        _interpolate(poses[:, g], determined[:, g], loose[:, g])
    return FittedFrames(poses, determined, loose, residuals, *_usual_residuals(residuals, scene, settings))


def _usual_residuals(residuals: Array, scene: Scene, settings: Settings) -> tuple[Array, Array]:
    """Return the median (M, 3) of residuals and their robust standard deviation (M,)."""
    M = residuals.shape[1]
    usual, scatter = np.zeros((M, 3)), np.maximum(scene.spread, settings.least_spread)
    for i in range(M):
        seen = residuals[np.isfinite(residuals[:, i, 0]), i]
        if len(seen) >= settings.familiar:
            usual[i] = np.median(seen, axis=0)
            scatter[i] = max(1.4826 * float(np.median(np.abs(seen - usual[i]))), settings.least_spread)
    return usual, scatter


def _interpolate(poses: Array, determined: Mask, loose: Mask) -> None:
    """Interpolate undetermined angles, and palms with fewer than three markers, in place."""
    tracked = np.isfinite(poses[:, 0])
    frames = np.flatnonzero(tracked)
    if len(frames) == 0:
        return
    for a in range(20):
        known = np.flatnonzero(tracked & determined[:, a])
        if 0 < len(known) < len(frames):
            poses[frames, 7 + a] = np.interp(frames, known, poses[known, 7 + a])
    known = np.flatnonzero(tracked & ~loose)
    if 0 < len(known) < len(frames):
        palm = poses[known, :7].copy()
        flips = np.cumprod(np.where(np.sum(palm[1:, 3:] * palm[:-1, 3:], axis=1) < 0, -1.0, 1.0))
        palm[1:, 3:] *= flips[:, None]
        for c in range(7):
            poses[frames, c] = np.interp(frames, known, palm[:, c])
        poses[frames, 3:7] = normalised(poses[frames, 3:7])


@compiled(nogil=True)
def _fit_frames(
    positions: Array,
    labels: Index,
    scene: Scene,
    settings: Settings,
    poses: Array,
    usual: Array,
    scatter: Array,
    determined: Mask,
    loose: Mask,
    residuals: Array,
) -> None:
    G, M = scene.rigid.shape[0], scene.body.shape[0]
    targets, weights, placed = np.zeros((M, 3)), np.zeros(M), np.empty((M, 3))
    frozen, slope = np.zeros(20, np.bool_), np.zeros((G, 20))
    bodies = BodyPoses(np.empty((16, 3, 4)), np.empty((20, 3)), np.empty((20, 3)))
    fit = PoseFit(5 * settings.iterations, settings.damping, settings.avoid_limits)
    for t in range(labels.shape[0]):
        for g in range(G):
            pose = poses[t, g]
            if np.isnan(pose[0]):
                continue
            visible = 0
            for i in range(scene.first[g], scene.first[g + 1]):
                weights[i] = 0.0
                if labels[t, i] >= 0:
                    weights[i], visible = 1.0, visible + 1
                    targets[i] = positions[labels[t, i]]
            determined_angles(scene, g, labels[t], determined[t, g])
            loose[t, g] = visible < 3
            for a in range(20):
                frozen[a] = not determined[t, g, a]
            if visible > 0:
                fit_pose(scene, g, fit, targets, weights, frozen, pose, slope[g], bodies)
            for _ in range(2 if settings.robust > 0 else 0):
                place_markers(scene, g, pose, bodies, placed)
                outliers = False
                for i in range(scene.first[g], scene.first[g + 1]):
                    if labels[t, i] >= 0:
                        R, e, square = bodies.T[scene.body[i]], usual[i], 0.0
                        for r in range(3):
                            kept = R[r, 0] * e[0] + R[r, 1] * e[1] + R[r, 2] * e[2]
                            square += (targets[i, r] - placed[i, r] - kept) ** 2
                        share = np.sqrt(square / (scatter[i] ** 2 + 3 * settings.noise**2)) / settings.robust
                        weights[i] = 1 / (1 + share * share) ** 2
                        outliers |= share > 1.0
                if not outliers:
                    break
                fit_pose(scene, g, fit, targets, weights, frozen, pose, slope[g], bodies)
            place_markers(scene, g, pose, bodies, placed)
            for i in range(scene.first[g], scene.first[g + 1]):
                if labels[t, i] >= 0:
                    R = bodies.T[scene.body[i]]
                    x, y, z = targets[i] - placed[i]
                    for r in range(3):
                        residuals[t, i, r] = R[0, r] * x + R[1, r] * y + R[2, r] * z


class ExpectedFrames(NamedTuple):
    """Where markers are expected from the other frames and markers.

    position: (T, M, 3) metres; NaN where the model is not tracked.
    precision: (T, M, 3, 3) inverse of its covariance, 1/m^2.
    peak: (T, M) logarithm of the normal density at the expected position, 1/m^3.
    """

    position: Array
    precision: Array
    peak: Array


def expect_markers(fitted: FittedFrames, scene: Scene, settings: Settings) -> ExpectedFrames:
    """Return the places of all markers on the fitted models, with their usual residuals."""
    T, M = len(fitted.poses), len(scene.body)
    absent = np.zeros((T, M), np.int64)
    for i in range(M):
        absent[:, i] = _frames_to_nearest(np.isfinite(fitted.residuals[:, i, 0]))
    undetermined = np.zeros(fitted.determined.shape, np.int64)
    loose = np.zeros(fitted.loose.shape, np.int64)
    for g in range(len(scene.rigid)):
        loose[:, g] = _frames_to_nearest(~fitted.loose[:, g])
        for a in range(20):
            undetermined[:, g, a] = _frames_to_nearest(fitted.determined[:, g, a])
    out = ExpectedFrames(np.full((T, M, 3), np.nan), np.zeros((T, M, 3, 3)), np.zeros((T, M)))
    _expect(fitted.poses, fitted.usual, fitted.scatter, absent, undetermined, loose, scene, settings, out)
    return out


def _frames_to_nearest(known: Mask) -> Index:
    """Return the distance (T,) of each frame to the nearest of a mask (T,); 1000 for none."""
    frames, chosen = np.arange(len(known)), np.flatnonzero(known)
    if len(chosen) == 0:
        return np.full(len(known), 1000)
    after = np.searchsorted(chosen, frames)
    ahead = chosen[np.minimum(after, len(chosen) - 1)]
    behind = chosen[np.maximum(after - 1, 0)]
    return np.minimum(np.abs(ahead - frames), np.abs(frames - behind))


@compiled(nogil=True)
def _expect(
    poses: Array,
    usual: Array,
    scatter: Array,
    absent: Index,
    undetermined: Index,
    loose: Index,
    scene: Scene,
    settings: Settings,
    out: ExpectedFrames,
) -> None:
    bodies = BodyPoses(np.empty((16, 3, 4)), np.empty((20, 3)), np.empty((20, 3)))
    placed = np.empty((scene.body.shape[0], 3))
    for t in range(poses.shape[0]):
        for g in range(poses.shape[1]):
            if np.isnan(poses[t, g, 0]):
                continue
            place_markers(scene, g, poses[t, g], bodies, placed)
            for i in range(scene.first[g], scene.first[g + 1]):
                T, e = bodies.T[scene.body[i]], usual[i]
                for r in range(3):
                    out.position[t, i, r] = placed[i, r] + T[r, 0] * e[0] + T[r, 1] * e[1] + T[r, 2] * e[2]
                out.peak[t, i] = model_precision(
                    scene,
                    settings,
                    i,
                    bodies,
                    placed[i],
                    scatter[i],
                    absent[t, i],
                    undetermined[t, g],
                    loose[t, g],
                    out.precision[t, i],
                )
