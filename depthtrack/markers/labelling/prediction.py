"""Expected position of each marker in the next frame, and the spread of it."""

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.hand.compiled_kinematics import BodyPoses
from depthtrack.hand.compiled_tangent import retract
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.markers.labelling.scene import Scene, place_markers
from depthtrack.markers.labelling.state import FrameLabels, Settings, TrackState
from depthtrack.types import Array, Index

_LOWER, _UPPER = np.array(LOWER), np.array(UPPER)


@compiled(nogil=True)
def predict(scene: Scene, settings: Settings, state: TrackState, poses: Array, placed: Array, out: FrameLabels) -> None:
    """Predict the markers of all active models.

    poses: (G, 27) receive the poses with the last step repeated, angles within their limits.
    placed: (M, 3) receives the markers of these poses, metres.
    out: receives `expected`, `precision` and `peak`.
    """
    bodies = BodyPoses(np.empty((16, 3, 4)), np.empty((20, 3)), np.empty((20, 3)))
    for g in range(poses.shape[0]):
        if not state.active[g]:
            continue
        retract(state.pose[g], state.step[g], poses[g])
        for a in range(20):
            poses[g, 7 + a] = min(max(poses[g, 7 + a], _LOWER[a]), _UPPER[a])
        if scene.rigid[g]:
            poses[g, 7:] = 0.0
        place_markers(scene, g, poses[g], bodies, placed)
        for i in range(scene.first[g], scene.first[g + 1]):
            if state.missing[i] == 0 and not settings.from_model:
                for r in range(3):
                    out.expected[i, r] = state.position[i, r] + state.velocity[i, r]
                change = settings.acceleration if state.run[i] > 2 else settings.acceleration + settings.palm_drift
                out.peak[i] = isotropic(4 * settings.noise**2 + change**2, out.precision[i])
                continue
            T, e = bodies.T[scene.body[i]], state.residual[i]
            share = 0.0 if settings.from_model else residual_share(settings, state, i)
            for r in range(3):
                out.expected[i, r] = placed[i, r] + share * (T[r, 0] * e[0] + T[r, 1] * e[1] + T[r, 2] * e[2])
            out.peak[i] = model_precision(
                scene,
                settings,
                i,
                bodies,
                placed[i],
                residual_spread(scene, settings, state, i),
                state.missing[i],
                state.undetermined[g],
                state.loose[g],
                out.precision[i],
            )


@compiled(nogil=True)
def residual_share(settings: Settings, state: TrackState, i: int) -> float:
    """Return the share of a marker's mean residual in its expected one; the rest is zero."""
    return state.seen[i] / (state.seen[i] + settings.familiar)


@compiled(nogil=True)
def residual_spread(scene: Scene, settings: Settings, state: TrackState, i: int) -> float:
    """Return the standard deviation of a marker's residual about the expected one, metres."""
    unknown = (1 - residual_share(settings, state, i)) * max(scene.spread[i], settings.least_spread) ** 2
    return float(np.sqrt(settings.least_spread**2 + unknown))


@compiled(nogil=True)
def isotropic(variance: float, precision: Array) -> float:
    """Write the precision (3, 3) of equal variances; return the log density at the peak."""
    precision[:] = 0.0
    for r in range(3):
        precision[r, r] = 1 / variance
    return -1.5 * np.log(2 * np.pi * variance)


@compiled(nogil=True)
def model_precision(
    scene: Scene,
    settings: Settings,
    i: int,
    bodies: BodyPoses,
    place: Array,
    spread: float,
    absent: int,
    undetermined: Index,
    loose: int,
    precision: Array,
) -> float:
    """Write the precision (3, 3) of a marker on the model; return the log density at the peak.

    Each joint that moves the marker drifts from the frame on in which it last moved a visible one. Its drift moves the
    marker along an arc, and in no other direction.

    place: (3,) of the marker on the posed model, metres.
    spread: standard deviation of its residual, metres.
    absent: frames since the marker was seen.
    undetermined: (20,) frames since each angle moved a visible marker.
    loose: frames since three markers of the model were visible.
    """
    own = 4 * settings.noise**2 + settings.acceleration**2 + spread**2 + (settings.palm_drift * loose) ** 2
    own = min(own, settings.largest**2)
    xx, yy, zz, xy, xz, yz = own, own, own, 0.0, 0.0, 0.0
    for a in range(20):
        if not scene.moves[i, a]:
            continue
        drift = min(settings.determined, settings.joint_drift * absent)
        drift += min(settings.joint_range, settings.joint_drift * undetermined[a])
        u, o = bodies.axes[a], bodies.origins[a]
        x, y, z = place[0] - o[0], place[1] - o[1], place[2] - o[2]
        cx, cy, cz = drift * (u[1] * z - u[2] * y), drift * (u[2] * x - u[0] * z), drift * (u[0] * y - u[1] * x)
        # The arc bends away from its tangent.
        bend = drift * drift * (cx * cx + cy * cy + cz * cz) / 4
        xx, yy, zz = xx + cx * cx + bend, yy + cy * cy + bend, zz + cz * cz + bend
        xy, xz, yz = xy + cx * cy, xz + cx * cz, yz + cy * cz
    axx, axy, axz = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    determinant = xx * axx + xy * axy + xz * axz
    precision[0, 0], precision[1, 1], precision[2, 2] = axx, xx * zz - xz * xz, xx * yy - xy * xy
    precision[0, 1], precision[0, 2], precision[1, 2] = axy, axz, xy * xz - xx * yz
    precision[1, 0], precision[2, 0], precision[2, 1] = precision[0, 1], precision[0, 2], precision[1, 2]
    for r in range(3):
        for k in range(3):
            precision[r, k] /= determinant
    return -1.5 * np.log(2 * np.pi) - 0.5 * np.log(determinant)


@compiled(nogil=True)
def mahalanobis(precision: Array, expected: Array, point: Array) -> float:
    """Return the squared Mahalanobis distance of a point (3,) from its expected position (3,)."""
    x, y, z = point[0] - expected[0], point[1] - expected[1], point[2] - expected[2]
    P = precision
    diagonal = P[0, 0] * x * x + P[1, 1] * y * y + P[2, 2] * z * z
    return float(diagonal + 2 * (P[0, 1] * x * y + P[0, 2] * x * z + P[1, 2] * y * z))
