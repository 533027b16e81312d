"""Calibration: sizes from a recording, gradients, and rejected recordings."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from depthtrack.calibration import joint_optimisation
from depthtrack.calibration.calibrate import Calibration, calibrate, summary
from depthtrack.calibration.fitted_hand import with_usual_proportions
from depthtrack.calibration.joint_optimisation import fit_jointly, size_covariance
from depthtrack.calibration.options import CalibrationOptions, JointFitOptions
from depthtrack.calibration.residuals import CalibrationView, PosedSkin, linearise
from depthtrack.calibration.solid_hands import is_solid, nearest_solid, solid_step
from depthtrack.calibration.views import choose_views, finger_area
from depthtrack.cli import main
from depthtrack.cli.calibrate import _text
from depthtrack.cli.hand_options import size_notes
from depthtrack.errors import InputError
from depthtrack.evaluation.metrics import endpoint_error
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rotations import quaternion_product
from depthtrack.hand.displacement_grid import NODES
from depthtrack.hand.kinematics import KEYPOINT_BODIES, HandModel
from depthtrack.hand.pose import ANGLES, FINGERS, make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.shape import HandShape, Side
from depthtrack.hand.size_parameters import (
    COUNT,
    KNUCKLES,
    LENGTHS,
    SCALE,
    hand_of,
    measures,
    motion_of,
    prior_covariance,
)
from depthtrack.hand.skin.mesh import Skin
from depthtrack.recording import SequenceWriter, open_sequence
from depthtrack.rendering.triangles import rasterise
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.synthesis.generate import Synthesis, Synthesiser, write_recording
from depthtrack.tracking.configuration import IkConfig
from depthtrack.tracking.registry import create_tracker
from depthtrack.tracking.stretches import StretchOptions
from depthtrack.viewing.calibration_picture import shown_views
from tests.support.observations import observe

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("calibration")]


def _towards_camera(turn: float) -> np.ndarray:
    """Return the pose of a relaxed palm, turned about its long axis by an angle."""
    palm = np.array([0.0, 1.0, 0.0, 0.0])
    about_y = np.array([np.cos(turn / 2), 0.0, np.sin(turn / 2), 0.0])
    return make_pose([0, 0, 0.5], quaternion_product(palm, about_y), POSTURES["relaxed"])


def _rendered(pose: np.ndarray, hand: HandShape | None = None) -> Observation:
    """Return the observation of a hand, by default the true one, without noise."""
    camera = Camera(240, 240, 500, 500, 120, 120)
    skin = Skin.of(hand or TRUE_HAND)
    vertices = skin.at(pose)
    surface = rasterise(camera, vertices, skin.faces, skin.normals(vertices), skin.face_bodies)
    depth = surface.depth.astype(np.float32)
    return Observation(camera, depth > 0, depth, 0, 0.0, camera.rect, pose[:3].copy(), palm_radius=0.04)


def _empty_room(folder: Path) -> Path:
    """Write a recording of a wall, four frames."""
    camera = Camera(64, 48, 60, 60, 31.5, 23.5, 0.001)
    with SequenceWriter(folder, camera) as writer:
        for i in range(4):
            writer.append(0.1 * i, np.full(camera.shape, 1.5, np.float32))
    return folder


def _sizes() -> np.ndarray:
    """Return the sizes (35,) of a hand of scale 0.9 with a middle finger longer by a tenth."""
    values = np.zeros(COUNT)
    values[SCALE] = np.log(0.9)
    values[LENGTHS][6:9] = np.log(1.1)
    return values


TRUE_HAND = hand_of(_sizes(), "right")


@pytest.fixture(scope="module")
def made() -> Synthesiser:
    return Synthesiser(Synthesis(model="skin", hand=TRUE_HAND, frames=160))


@pytest.fixture(scope="module")
def calibration(made: Synthesiser, tmp_path_factory: pytest.TempPathFactory) -> Calibration:
    """Three stretches are tracked, at most three times."""
    folder = tmp_path_factory.mktemp("calibration") / "everyday"
    write_recording(made, folder)
    options = CalibrationOptions(stretches=StretchOptions(stretches=3), rounds=3)
    return calibrate(open_sequence(folder), "right", options=options)


def test_scale_lengths_and_side_are_recovered(calibration: Calibration) -> None:
    hand = calibration.hand
    assert (hand.side, hand.source) == ("right", "calibrated on everyday")
    assert hand.scale == pytest.approx(0.9, rel=0.02)
    found, true = hand.lengths.sum(axis=1) * hand.scale, TRUE_HAND.lengths.sum(axis=1) * TRUE_HAND.scale
    np.testing.assert_allclose(found, true, atol=0.0025)
    np.testing.assert_allclose(hand.radii * hand.scale, TRUE_HAND.radii * TRUE_HAND.scale, atol=0.001)
    assert hand.palm_breadth * hand.scale == pytest.approx(TRUE_HAND.palm_breadth * 0.9, rel=0.04)
    assert calibration.after_mm < 0.5 < calibration.before_mm


def test_standard_deviations_cover_the_errors(calibration: Calibration) -> None:
    truth = {name: 1000 * metres for name, (metres, _) in measures(_sizes()).items()}
    for name, found in calibration.measured.items():
        assert 0 < found.confidence < 1
        assert abs(found.mm - truth[name]) < 3 * found.sigma_mm, name


def test_a_calibrated_hand_is_tracked_better(made: Synthesiser, calibration: Calibration) -> None:
    frames, errors = range(100, 125), {}
    observations = [observe(made, i) for i in frames]
    for name, hand in (("average", HandShape()), ("calibrated", calibration.hand)):
        tracker = create_tracker(IkConfig(), hand)
        first = tracker.start(observations[0], made.poses[frames.start])
        poses = [first.pose, *(tracker.track(o).pose for o in observations[1:])]
        truth = HandModel(TRUE_HAND), made.poses[frames.start : frames.stop]
        errors[name] = endpoint_error(HandModel(hand), np.array(poses), *truth).values.mean()
    assert errors["calibrated"] < 2.5
    assert errors["calibrated"] < errors["average"] / 2


def test_the_file_can_be_read_as_a_hand(calibration: Calibration, tmp_path: Path) -> None:
    (tmp_path / "hand.json").write_text(calibration.to_json())
    assert HandShape.from_json(tmp_path / "hand.json") == calibration.hand


def test_views_are_shown_in_the_order_of_the_recording(calibration: Calibration) -> None:
    observations = calibration.observations[::-1]
    shown = [observations[i].frame_index for i in shown_views(observations)]
    assert len(shown) == 4
    assert shown == sorted(shown)


@pytest.mark.parametrize(("margin", "sure"), [(0.012, False), (0.3, True), (None, True)])
def test_a_side_with_a_small_margin_is_not_sure(calibration: Calibration, margin: float | None, sure: bool) -> None:
    certain = {name: replace(m, confidence=0.9999) for name, m in calibration.measured.items()}
    found = replace(calibration, side_margin=margin, measured=certain)
    assert summary(found)["side_sure"] == sure
    text = _text(found, Path("hand.json"), Path("hand.png"))
    assert ("the side is uncertain; give --side" in text) == (not sure)
    assert "0.99" in text
    assert "1.00\n" not in text


def test_a_displaced_skin_is_recovered() -> None:
    """Fingers are thicker on the palmar side alone, which no sizes describe."""
    displacement = np.zeros(NODES)
    rows = displacement[: 5 * 7 * 8].reshape(5, 7, 8)
    rows[:, :, 1:4] = 0.0025
    hand = HandShape(displacement=displacement)
    model, poses = HandModel(hand), np.stack([_towards_camera(turn) for turn in np.linspace(-0.7, 0.7, 6)])
    views = [CalibrationView(_rendered(pose, hand)) for pose in poses]
    plain = fit_jointly(views, poses, np.zeros(COUNT), "right", 8, exact=True)
    displaced = fit_jointly(views, poses, np.zeros(COUNT + NODES), "right", 12, exact=True)
    assert np.median(displaced.distances) < 0.7 * np.median(plain.distances)
    of_fits = [(HandModel(hand_of(fit.values, "right")), fit.poses) for fit in (plain, displaced)]
    errors = [endpoint_error(found, fitted, model, poses).values.mean() for found, fitted in of_fits]
    assert errors[1] < errors[0]


@pytest.mark.parametrize("side", ["right", "left"])
def test_gradients_agree_with_finite_differences_on_the_bones(side: Side) -> None:
    generator = np.random.default_rng(3)
    values = 0.5 * generator.standard_normal(COUNT) * np.sqrt(np.diag(prior_covariance()))
    pose = make_pose([0.02, 0, 0.5], [0.5, 0.5, -0.4, 0.6], POSTURES["relaxed"])

    def joints(v: np.ndarray) -> np.ndarray:
        return HandModel(hand_of(v, side)).endpoints(pose)

    # A joint is fixed to the bone before it, whose length moves it.
    J = motion_of(HandModel(hand_of(values, side)), pose, KEYPOINT_BODIES[1:], joints(values))
    step = 1e-6 * np.eye(COUNT)
    expected = np.stack([(joints(values + d) - joints(values - d)) / 2e-6 for d in step], axis=-1)
    np.testing.assert_allclose(J, expected, atol=1e-8)


def test_usual_proportions_do_not_change_the_hand() -> None:
    generator = np.random.default_rng(4)
    values = generator.standard_normal(COUNT) * np.sqrt(np.diag(prior_covariance()))
    before, after = hand_of(values, "left"), hand_of(with_usual_proportions(values), "left")
    assert after.scale != pytest.approx(before.scale, rel=1e-3)
    for name in ("lengths", "radii", "bases", "palm_breadth", "palm_length", "palm_thickness", "wrist_breadth"):
        expected = np.asarray(getattr(before, name)) * before.scale
        np.testing.assert_allclose(np.asarray(getattr(after, name)) * after.scale, expected, atol=1e-12)


def test_sizes_without_observations_keep_the_prior() -> None:
    """An open hand determines the hand's length better than a fist.

    Straight fingers leave open where their base joints are: a finger's length begins there, the hand's at the wrist.
    """
    frames = {"fist": POSTURES["fist"], "open": POSTURES["open"]}
    gradients = {name: g for name, (_, g) in measures(_sizes()).items() if name.endswith("_length")}
    variances = {"nothing": {name: float(g @ size_covariance(JointFitOptions()) @ g) for name, g in gradients.items()}}
    for posture, angles in frames.items():
        pose = make_pose([0, 0, 0.5], [0, 1, 0, 0], angles)
        view = CalibrationView(_rendered(pose))
        fit = fit_jointly([view], pose[None], _sizes(), "right", iterations=1)
        variances[posture] = {name: float(g @ fit.covariance @ g) for name, g in gradients.items()}
    assert variances["open"]["hand_length"] < 0.9 * variances["fist"]["hand_length"]
    of_fingers = {name: sum(each.values()) for name, each in variances.items()}
    assert max(of_fingers["open"], of_fingers["fist"]) < 0.5 * of_fingers["nothing"]


def test_the_true_hand_in_its_true_pose_has_no_residuals(made: Synthesiser) -> None:
    observation = observe(made, 40)
    true = linearise(CalibrationView(observation), made.poses[40], PosedSkin(TRUE_HAND), 0.006)
    average = linearise(CalibrationView(observation), made.poses[40], PosedSkin(HandShape()), 0.006)
    assert true.distance < 1e-4 < average.distance
    assert np.abs(true.g).max() < 0.02 * np.abs(average.g).max()


def test_the_skin_of_a_hand_nearby_is_stretched_instead_of_built(made: Synthesiser) -> None:
    """It is closer to the built one than the stretched skin of the average hand."""
    displacement = np.full(NODES, 0.001)
    values = np.append(_sizes() + 0.02 * np.random.default_rng(5).standard_normal(COUNT), displacement)
    values[KNUCKLES.start : COUNT] = 0.0
    near, view = np.append(_sizes(), displacement), CalibrationView(observe(made, 40))
    hand = hand_of(values, "right")
    exact, stretched, average = (
        PosedSkin(hand, built).seen(view, made.poses[40]).depth for built in (hand, hand_of(near, "right"), None)
    )
    for depth, most in ((stretched, 0.0003), (average, 0.003)):
        both = (depth > 0) & (exact > 0)
        assert np.mean(np.abs(depth - exact)[both]) < most
    assert np.mean(np.abs(stretched - exact)[(stretched > 0) & (exact > 0)]) < 0.5 * np.mean(
        np.abs(average - exact)[(average > 0) & (exact > 0)]
    )


def test_fingers_that_grow_together_are_parted() -> None:
    """The bases of three fingers are moved to the same place."""
    values, across = _sizes(), slice(KNUCKLES.start, KNUCKLES.start + 6, 2)
    values[across] = -0.02, 0.0, 0.02
    assert not is_solid(values, "left")
    parted = nearest_solid(values, "left")
    assert is_solid(parted, "left")
    assert parted[SCALE] == values[SCALE]
    assert -0.02 < parted[KNUCKLES.start] < 0
    assert nearest_solid(_sizes(), "left").tolist() == _sizes().tolist()
    assert is_solid(solid_step(_sizes(), values - _sizes(), "left"), "left")


def test_the_skin_stays_as_built_where_no_step_keeps_the_hand_solid(
    made: Synthesiser, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Small steps may have left the solid sizes before."""
    joined, across = _sizes(), slice(KNUCKLES.start, KNUCKLES.start + 6, 2)
    joined[across] = -0.02, 0.0, 0.02
    monkeypatch.setattr(joint_optimisation, "solid_step", lambda *_: joined)
    monkeypatch.setattr(joint_optimisation, "_differ", lambda *_: True)
    view = CalibrationView(observe(made, 40))
    fit = fit_jointly([view], made.poses[[40]], _sizes(), "right", iterations=2, exact=True)
    assert np.isfinite(fit.distances).all()


def test_fingers_that_hardly_bend_are_named() -> None:
    poses = np.tile(_towards_camera(0.0), (3, 1))
    poses[:, ANGLES] += np.radians(1.0) * np.random.default_rng(3).standard_normal((3, 20))
    found = SimpleNamespace(poses=poses, is_of_usual_size=True)
    found.stiff_fingers = Calibration.stiff_fingers.fget(found)  # type: ignore[attr-defined]
    assert found.stiff_fingers == FINGERS[1:]
    (note,) = size_notes(found)  # type: ignore[arg-type]
    assert note.startswith("fingers hardly bend (index, middle, ring, little), so their joints may be wrong")
    poses[1, ANGLES.start + 4 * 2 + 2] += np.radians(30)  # the second flexion of the middle finger
    assert Calibration.stiff_fingers.fget(found) == ("index", "ring", "little")  # type: ignore[attr-defined]


def test_open_hands_are_chosen_before_fists() -> None:
    open_hand, fist = (_rendered(make_pose([0, 0, 0.5], [0, 1, 0, 0], POSTURES[name])) for name in ("open", "fist"))
    assert finger_area(open_hand) > 4 * finger_area(fist)


def test_recordings_without_a_hand_are_rejected(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    empty = _empty_room(tmp_path / "empty")
    with pytest.raises(InputError, match="0 of 4 frames"):
        choose_views(open_sequence(empty), Segmenter())
    assert main(["calibrate", str(empty), "-o", str(tmp_path / "hand.json")]) == 2
    assert "calibrating needs at least 3 frames" in capsys.readouterr().err
    assert main(["calibrate", str(empty), "-o", str(tmp_path)]) == 2
    assert "-o must be a file, found the folder" in capsys.readouterr().err
    assert not (tmp_path / "hand.json").exists()
