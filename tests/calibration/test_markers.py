"""Calibration of marker offsets and hand sizes on labelled captures."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from depthtrack.calibration.marker_equations import MarkerParameters, frame_energy, frame_equations
from depthtrack.calibration.markers import calibrate_markers, calibrate_on_positions, self_calibrate
from depthtrack.calibration.options import MarkerCalibrationOptions
from depthtrack.errors import InputError
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.pose import ANGLES, make_pose, retract
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.shape import HandShape, Side
from depthtrack.hand.size_parameters import COUNT, prior_covariance, resized
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.models.layout import load_layout
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.markers.models.sized_fit import PosturePrior, SizedFitter
from depthtrack.types import Array

FEW = MarkerCalibrationOptions(frames=20, iterations=10)
STEP = 1e-6


def subject(name: str, side: Side, seed: int) -> MarkerModel:
    rng = np.random.default_rng(seed)
    hand = resized(HandShape(side=side), rng.multivariate_normal(np.zeros(COUNT), prior_covariance()))
    model = load_layout(name, hand)
    return model.with_(offsets=model.offsets + rng.normal(0, 0.003, model.offsets.shape))


def some_poses(count: int, seed: int) -> Array:
    """Return poses between typical postures, turned in many ways."""
    rng = np.random.default_rng(seed)
    postures = np.stack(list(POSTURES.values()))
    shares = rng.dirichlet(np.full(len(postures), 0.5), count)
    angles = np.clip(shares @ postures + rng.normal(0, 0.1, (count, 20)), LOWER, UPPER)
    return make_pose(rng.normal(0, 0.1, (count, 3)), rng.normal(0, 1, (count, 4)), angles)


def labelled(model: MarkerModel, truth: MarkerModel, poses: Array, seed: int) -> LabelledCapture:
    rng = np.random.default_rng(seed)
    positions = truth.positions(poses) + rng.normal(0, 0.0003, (len(poses), len(truth.labels), 3))
    capture = MarkerCapture(100.0, truth.labels, positions)
    columns = np.tile(np.arange(len(truth.labels)), (len(poses), 1))
    return LabelledCapture(capture, (model,), (columns,), (np.full_like(poses, np.nan),), (np.ones(columns.shape),))


@pytest.mark.parametrize("side", ["right", "left"])
def test_gradient_is_that_of_finite_differences(side: Side) -> None:
    rng = np.random.default_rng(3)
    model, pose = load_layout("13", HandShape(side=side)), some_poses(1, 2)[0]
    prior = PosturePrior.from_synergies(2, 0.3)
    parameters = MarkerParameters.of(SizedFitter(model, 0.001, prior), MarkerCalibrationOptions())
    values = rng.normal(0, 0.05, COUNT + 39)
    values[COUNT:] *= 0.05
    points = parameters.positions(values, pose) + rng.normal(0, 0.004, (13, 3))
    points[4] = np.nan
    _, g = frame_equations(parameters, values, pose, points, 0.01)
    for j in range(len(g)):
        d = STEP * np.eye(len(g))[j]
        ahead, behind = (
            frame_energy(parameters, values + s * d[26:], retract(pose, s * d[:26]), points, 0.01) for s in (1, -1)
        )
        assert g[j] == pytest.approx((ahead - behind) / (2 * STEP), rel=1e-4, abs=1e-3 * np.abs(g).max()), j


def test_sizes_and_offsets_are_recovered_within_their_spread() -> None:
    truth, average = subject("26", "left", 1), load_layout("26", HandShape(side="left"))
    capture = labelled(average, truth, some_poses(60, 1), 1)
    found = calibrate_markers(capture, options=FEW)
    hand, true = found.model.hand, truth.hand
    assert hand is not None
    assert true is not None
    assert found.after < 0.001 < found.before
    assert hand.side == "left"
    error = np.log(hand.lengths * hand.scale / (true.lengths * true.scale))
    prior_error = np.log(HandShape().lengths / (true.lengths * true.scale))
    assert np.abs(error).mean() < 0.5 * np.abs(prior_error).mean()
    J = np.zeros((15, len(found.covariance)))
    J[:, 0], J[np.arange(15), 1 + np.arange(15)] = 1, 1
    deviation = np.sqrt(np.diag(J @ found.covariance @ J.T))
    assert (np.abs(error.ravel()) < 3.5 * deviation).all()
    assert (found.offset_spread < 0.006).all()
    for name, (size, spread) in found.sizes().items():
        assert 0 < spread < 0.2 * size, name
    others = some_poses(10, 9)
    misfit = np.linalg.norm(found.model.positions(others) - truth.positions(others), axis=-1)
    assert np.isfinite(misfit).all()


def test_calibrated_model_is_saved_and_read_back(tmp_path: Path) -> None:
    truth, average = subject("13", "right", 2), load_layout("13", HandShape())
    model = calibrate_markers(labelled(average, truth, some_poses(30, 3), 3), options=FEW).model
    (tmp_path / "right.json").write_text(model.to_json())
    again = MarkerModel.from_json(tmp_path / "right.json")
    assert again.to_json() == model.to_json()
    assert again.size_spread is not None
    pose = some_poses(1, 4)[0]
    np.testing.assert_allclose(again.positions(pose), model.positions(pose), atol=1e-8)


def test_wrong_labels_in_some_frames_hardly_change_the_hand() -> None:
    truth, average = subject("19", "right", 5), load_layout("19", HandShape())
    positions = truth.positions(some_poses(50, 6))
    swapped = positions.copy()
    swapped[::12, [2, 5]] = positions[::12, [5, 2]]
    clean, disturbed = (calibrate_on_positions(average, x, options=FEW).values for x in (positions, swapped))
    assert np.abs(clean - disturbed).max() < 0.02


def test_gaps_are_left_out() -> None:
    truth, average = subject("19", "right", 7), load_layout("19", HandShape())
    positions = truth.positions(some_poses(40, 8))
    positions[np.random.default_rng(0).random(positions.shape[:2]) < 0.1] = np.nan
    assert calibrate_on_positions(average, positions, options=FEW).after < 0.001


def test_rigid_body_is_refused() -> None:
    body = MarkerModel("box", ("a", "b", "c"), np.zeros(3, np.int64), np.eye(3) * 0.05, np.zeros(3))
    with pytest.raises(InputError, match="is a rigid body"):
        calibrate_on_positions(body, np.zeros((20, 3, 3)))


def test_too_few_complete_frames_are_refused() -> None:
    average = load_layout("13", HandShape())
    positions = average.positions(some_poses(20, 1))
    positions[5:, :6] = np.nan
    with pytest.raises(InputError, match="5 frames show 70%"):
        calibrate_on_positions(average, positions)


def test_loop_labels_with_the_calibrated_hand() -> None:
    truth, average = subject("19", "right", 7), load_layout("19", HandShape())
    capture = labelled(average, truth, some_poses(30, 8), 2)
    body = MarkerModel("box", ("a", "b", "c"), np.zeros(3, np.int64), np.eye(3) * 0.05, np.zeros(3))
    used: list[tuple[MarkerModel, ...]] = []

    def label(_: MarkerCapture, models: tuple[MarkerModel, ...]) -> LabelledCapture:
        used.append(models)
        return replace(
            capture,
            models=models,
            columns=(capture.columns[0], np.full((30, 3), -1)),
            poses=(capture.poses[0], np.full((30, 27), np.nan)),
            confidence=(capture.confidence[0], np.full((30, 3), np.nan)),
        )

    models, again = self_calibrate(capture.capture, (average, body), label, rounds=1, options=FEW)
    assert len(used) == 2
    assert used[0] == (average, body)
    assert used[1] == models == again.models
    assert models[1] is body
    assert models[0].size_spread is not None


def test_poses_of_the_capture_are_where_fits_start() -> None:
    truth, average = subject("13", "right", 2), load_layout("13", HandShape())
    poses = some_poses(30, 3)
    found = calibrate_on_positions(average, truth.positions(poses), poses, FEW)
    assert found.after < 0.001
    assert (found.frames < 30).all()
    assert np.isfinite(poses[:, ANGLES]).all()
