"""Expected positions and their covariances."""

import numpy as np
from scipy.stats import multivariate_normal

from depthtrack.hand.compiled_kinematics import BodyPoses
from depthtrack.hand.shape import HandShape
from depthtrack.markers.labelling.options import LabellingOptions
from depthtrack.markers.labelling.prediction import isotropic, mahalanobis, model_precision, predict
from depthtrack.markers.labelling.scene import Scene, chain_of
from depthtrack.markers.labelling.state import FrameLabels, Settings, TrackState
from depthtrack.markers.models.layout import find_layout

SETTINGS = Settings.of(LabellingOptions(), 200.0)
MODEL = find_layout("26").on(HandShape())
SCENE = Scene.of([MODEL])


def pose_of(angle: float) -> np.ndarray:
    pose = np.zeros(27)
    pose[3], pose[7:] = 1.0, angle
    return pose


def test_the_covariance_follows_the_arcs_of_drifting_joints() -> None:
    pose, i = pose_of(0.2), MODEL.labels.index("index_distal")
    undetermined = np.zeros(20, np.int64)
    undetermined[7] = 10
    bodies = BodyPoses.at(chain_of(SCENE, 0), pose)
    place = MODEL.positions(pose)[i]
    P = np.empty((3, 3))
    peak = model_precision(SCENE, SETTINGS, i, bodies, place, 0.0015, 4, undetermined, 0, P)
    J = MODEL.kinematics.point_jacobian(pose, MODEL.bodies[[i]], place[None])[0, :, 6:]
    drift = np.full(20, min(SETTINGS.determined, 4 * SETTINGS.joint_drift))
    drift[7] += min(SETTINGS.joint_range, 10 * SETTINGS.joint_drift)
    own = 4 * SETTINGS.noise**2 + SETTINGS.acceleration**2 + 0.0015**2
    bend = np.sum(drift**4 * (J**2).sum(axis=0)) / 4
    covariance = J @ np.diag(drift**2) @ J.T + (own + bend) * np.eye(3)
    np.testing.assert_allclose(P @ covariance, np.eye(3), atol=0.02)
    point = place + np.array([0.004, -0.002, 0.003])
    expected = multivariate_normal(place, np.linalg.inv(P)).logpdf(point)
    assert np.isclose(peak - 0.5 * mahalanobis(P, place, point), expected)


def test_an_isotropic_density_is_the_normal_one() -> None:
    P = np.empty((3, 3))
    peak = isotropic(1e-6, P)
    point = np.array([1e-3, 0, -2e-3])
    expected = multivariate_normal(np.zeros(3), 1e-6 * np.eye(3)).logpdf(point)
    assert np.isclose(peak - 0.5 * mahalanobis(P, np.zeros(3), point), expected)


def test_visible_markers_go_on_and_missing_ones_follow_the_model() -> None:
    state, out = TrackState.empty(SCENE), FrameLabels.empty(26)
    state.start(SCENE, 0, pose_of(0.2))
    state.missing[0], state.position[0], state.velocity[0] = 0, [1.0, 2, 3], [0.01, 0, 0]
    state.missing[1], state.residual[1] = 3, [0, 0, 0.004]
    state.seen[1] = SETTINGS.familiar
    predict(SCENE, SETTINGS, state, np.empty((1, 27)), np.empty((26, 3)), out)
    np.testing.assert_allclose(out.expected[0], [1.01, 2, 3])
    body = MODEL.kinematics.transforms(pose_of(0.2))[MODEL.bodies[1]]
    np.testing.assert_allclose(out.expected[1], body[:3, :3] @ (MODEL.offsets[1] + [0, 0, 0.002]) + body[:3, 3])
    assert out.peak[0] > out.peak[1]
