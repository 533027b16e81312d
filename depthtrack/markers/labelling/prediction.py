"""Expected position of each marker in the next frame, and the spread of it."""

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.hand.compiled_kinematics import BodyPoses, retract
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
    out: receives `expected` and `deviation`.
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
            if settings.from_model:
                out.expected[i] = placed[i]
                out.deviation[i] = model_deviation(
                    scene,
                    settings,
                    i,
                    bodies,
                    placed[i],
                    state.missing[i],
                    state.undetermined[g],
                    state.loose[g],
                )
            elif state.missing[i] == 0:
                for r in range(3):
                    out.expected[i, r] = state.position[i, r] + state.velocity[i, r]
                out.deviation[i] = np.sqrt(4 * settings.noise**2 + settings.acceleration**2)
            else:
                T, e = bodies.T[scene.body[i]], state.residual[i]
                for r in range(3):
                    out.expected[i, r] = placed[i, r] + T[r, 0] * e[0] + T[r, 1] * e[1] + T[r, 2] * e[2]
                out.deviation[i] = model_deviation(
                    scene,
                    settings,
                    i,
                    bodies,
                    placed[i],
                    state.missing[i],
                    state.undetermined[g],
                    state.loose[g],
                )


@compiled(nogil=True)
def model_deviation(
    scene: Scene, settings: Settings, i: int, bodies: BodyPoses, place: Array, absent: int, undetermined: Index, loose: int
) -> float:
    """Return the spread in one coordinate of a marker that the model predicts, metres.

    Each joint that moves the marker drifts from the frame on in which it last moved a visible one.

    place: (3,) of the marker on the posed model, metres.
    absent: frames since the marker was seen.
    undetermined: (20,) frames since each angle moved a visible marker.
    loose: frames since three markers of the model were visible.
    """
    spread = max(scene.spread[i], settings.least_spread)
    total = 4 * settings.noise**2 + settings.acceleration**2 + spread**2
    for a in range(20):
        if not scene.moves[i, a]:
            continue
        drift = min(settings.determined, settings.joint_drift * absent)
        drift += min(settings.joint_range, settings.joint_drift * undetermined[a])
        u, o = bodies.axes[a], bodies.origins[a]
        x, y, z = place[0] - o[0], place[1] - o[1], place[2] - o[2]
        cx, cy, cz = u[1] * z - u[2] * y, u[2] * x - u[0] * z, u[0] * y - u[1] * x
        total += drift**2 * (cx * cx + cy * cy + cz * cz) / 3
    total += (settings.palm_drift * loose) ** 2
    return min(np.sqrt(total), settings.largest)
