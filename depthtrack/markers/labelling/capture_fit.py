"""Poses of all frames from labels, and where they put the markers that have no point."""

from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.geometry.rotations import normalised
from depthtrack.hand.compiled_kinematics import BodyPoses
from depthtrack.markers.labelling.pose_fit import PoseFit, fit_pose
from depthtrack.markers.labelling.prediction import model_deviation
from depthtrack.markers.labelling.scene import Scene, place_markers
from depthtrack.markers.labelling.state import Settings
from depthtrack.markers.labelling.step import determined_angles
from depthtrack.types import Array, Index, Mask


class FittedFrames(NamedTuple):
    """G models with M markers in T frames.

    poses: (T, G, 27) capture frame; NaN where a model has no start.
    determined: (T, G, 20) whether each angle moves a visible marker.
    loose: (T, G) whether fewer than three markers are visible.
    residuals: (T, M, 3) of the visible markers in the frames of their bodies, metres; NaN if missing.
    """

    poses: Array
    determined: Mask
    loose: Mask
    residuals: Array


def fit_capture(positions: Array, labels: Index, scene: Scene, settings: Settings, starts: Array) -> FittedFrames:
    """Return the poses that fit the labelled points; angles without a visible marker are interpolated in time.

    positions: (N, 3) metres.
    labels: (T, M) numbers of points; -1 for a missing marker.
    starts: (T, G, 27) poses near the solution; NaN where a model is not tracked.
    """
    T, G = starts.shape[:2]
    poses = np.ascontiguousarray(starts).copy()
    determined, loose = np.zeros((T, G, 20), np.bool_), np.zeros((T, G), np.bool_)
    residuals = np.full((*labels.shape, 3), np.nan)
    _fit_frames(positions, labels, scene, settings, poses, determined, loose, residuals)
    for g in range(G):
        _interpolate(poses[:, g], determined[:, g], loose[:, g])
    return FittedFrames(poses, determined, loose, residuals)


def _interpolate(poses: Array, determined: Mask, loose: Mask) -> None:
    """Replace undetermined angles, and palms with fewer than three markers, by interpolation in place."""
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
    determined: Mask,
    loose: Mask,
    residuals: Array,
) -> None:
    G, M = scene.rigid.shape[0], scene.body.shape[0]
    targets, weights, placed = np.zeros((M, 3)), np.zeros(M), np.empty((M, 3))
    frozen, slope = np.zeros(20, np.bool_), np.zeros((G, 20))
    bodies = BodyPoses(np.empty((16, 3, 4)), np.empty((20, 3)), np.empty((20, 3)))
    fit = PoseFit(2 * settings.iterations, settings.damping, settings.avoid_limits)
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
            for repeat in range(2 if settings.robust > 0 else 0):
                place_markers(scene, g, pose, bodies, placed)
                outliers = False
                for i in range(scene.first[g], scene.first[g + 1]):
                    if labels[t, i] >= 0:
                        spread = np.sqrt(max(scene.spread[i], settings.least_spread) ** 2 + 3 * settings.noise**2)
                        x, y, z = targets[i] - placed[i]
                        share = np.sqrt(x * x + y * y + z * z) / (settings.robust * spread)
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
    deviation: (T, M) standard deviation in one coordinate, metres.
    """

    position: Array
    deviation: Array


def expect_markers(fitted: FittedFrames, scene: Scene, settings: Settings) -> ExpectedFrames:
    """Return the places of all markers on the fitted models, with the residuals of the nearest frames."""
    T, M = fitted.residuals.shape[:2]
    residuals, limit = np.zeros((T, M, 3)), 3 * np.maximum(scene.spread, settings.least_spread)
    frames = np.arange(T)
    absent = np.zeros((T, M), np.int64)
    for i in range(M):
        seen = np.flatnonzero(np.isfinite(fitted.residuals[:, i, 0]))
        absent[:, i] = _frames_to_nearest(seen, T)
        for r in range(3):
            if len(seen):
                kept = np.clip(fitted.residuals[seen, i, r], -limit[i], limit[i])
                residuals[:, i, r] = np.interp(frames, seen, kept)
    undetermined = np.zeros(fitted.determined.shape, np.int64)
    loose = np.zeros(fitted.loose.shape, np.int64)
    for g in range(loose.shape[1]):
        loose[:, g] = _frames_to_nearest(np.flatnonzero(~fitted.loose[:, g]), T)
        for a in range(20):
            undetermined[:, g, a] = _frames_to_nearest(np.flatnonzero(fitted.determined[:, g, a]), T)
    out = ExpectedFrames(np.full((T, M, 3), np.nan), np.full((T, M), np.nan))
    _expect(fitted.poses, residuals, absent, undetermined, loose, scene, settings, out)
    return out


def _frames_to_nearest(known: Index, count: int) -> Index:
    """Return the distance (count,) of each frame to the nearest of some frames; 1000 if there is none."""
    frames = np.arange(count)
    if len(known) == 0:
        return np.full(count, 1000)
    after = np.searchsorted(known, frames)
    ahead = known[np.minimum(after, len(known) - 1)]
    behind = known[np.maximum(after - 1, 0)]
    return np.minimum(np.abs(ahead - frames), np.abs(frames - behind))


@compiled(nogil=True)
def _expect(
    poses: Array,
    residuals: Array,
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
                T, e = bodies.T[scene.body[i]], residuals[t, i]
                for r in range(3):
                    out.position[t, i, r] = placed[i, r] + T[r, 0] * e[0] + T[r, 1] * e[1] + T[r, 2] * e[2]
                out.deviation[t, i] = model_deviation(
                    scene, settings, i, bodies, placed[i], absent[t, i], undetermined[t, g], loose[t, g]
                )
