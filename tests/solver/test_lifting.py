"""Lifting of 2D keypoints to poses: accuracy with noise, gaps and swaps, and refusals."""

from dataclasses import replace

import numpy as np
import pytest

from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.pose import ANGLES
from depthtrack.hand.shape import HandShape
from depthtrack.hand.synergies import load_synergies
from depthtrack.solver.lifting import Lifter, half_thickness, measured_reach
from depthtrack.solver.options import LiftOptions
from depthtrack.synthesis.generate import Synthesiser
from depthtrack.types import Depth
from tests.support.keypoints import keypoints_of, mean_error

MODEL = HandModel(HandShape())
FRAMES = range(0, 360, 40)


@pytest.fixture(scope="module")
def lifter() -> Lifter:
    return Lifter(MODEL, load_synergies(), LiftOptions())


def depth_of(made: Synthesiser, index: int) -> Depth:
    frame = made[index]
    return np.where(frame.mask, frame.depth, 0).astype(np.float32)


@pytest.mark.parametrize(
    ("noise", "missing", "swapped", "most"),
    [(0.0, 0.0, None, 0.008), (3.0, 0.1, None, 0.010), (2.0, 0.0, (1, 2), 0.018)],
)
def test_a_pose_is_lifted(
    lifter: Lifter,
    everyday_skin: Synthesiser,
    noise: float,
    missing: float,
    swapped: tuple[int, int] | None,
    most: float,
) -> None:
    made, errors = everyday_skin, []
    for index in FRAMES:
        keypoints = keypoints_of(made, index, noise, missing, swapped)
        lifted = lifter.lift(keypoints, made.sensor.camera, depth_of(made, index))
        assert lifted is not None
        assert np.all((lifted.pose[ANGLES] >= LOWER - 1e-9) & (lifted.pose[ANGLES] <= UPPER + 1e-9))
        errors.append(mean_error(MODEL.keypoints(lifted.pose), made.joints[index]))
    assert np.mean(errors) < most


def test_points_that_are_hidden_are_not_measured(lifter: Lifter, everyday_skin: Synthesiser) -> None:
    errors, measured = [], []
    for index in FRAMES:
        lifted = lifter.lift(
            keypoints_of(everyday_skin, index), everyday_skin.sensor.camera, depth_of(everyday_skin, index)
        )
        assert lifted is not None
        known = np.isfinite(lifted.points).all(axis=-1)
        measured.append(known.mean())
        errors.append(np.linalg.norm(lifted.points - everyday_skin.joints[index], axis=-1)[known])
    assert np.percentile(np.concatenate(errors), 90) < 0.015
    assert 0.4 < np.mean(measured) < 1


def test_the_last_pose_holds_what_is_unknown(lifter: Lifter, everyday_skin: Synthesiser) -> None:
    made, index = everyday_skin, 80
    keypoints, truth = keypoints_of(made, index), made.poses[index]
    hidden = np.isin(np.arange(21), range(5, 9))
    pixels = np.where(hidden[:, None], np.nan, keypoints.pixels)
    keypoints = replace(keypoints, pixels=pixels, confidence=np.where(hidden, 0.0, keypoints.confidence))
    last = truth.copy()
    last[ANGLES][4:8] = np.radians([5, 70, 80, 40])
    errors = []
    for held in (None, last):
        lifted = lifter.lift(keypoints, made.sensor.camera, depth_of(made, index), held)
        assert lifted is not None
        errors.append(np.abs(lifted.pose[ANGLES][5:8] - last[ANGLES][5:8]).mean())
    assert errors[1] < errors[0]


def test_too_few_keypoints_or_no_depth_give_no_pose(lifter: Lifter, everyday_skin: Synthesiser) -> None:
    made, keypoints = everyday_skin, keypoints_of(everyday_skin, 0)
    camera, depth = made.sensor.camera, depth_of(made, 0)
    few = replace(keypoints, confidence=np.where(np.arange(21) < 7, 1.0, 0.1))
    assert lifter.lift(few, camera, depth) is None
    assert lifter.lift(keypoints, camera, np.zeros_like(depth)) is None
    outside = replace(keypoints, pixels=keypoints.pixels - 5000)
    assert lifter.lift(outside, camera, depth) is None


def test_a_reading_lies_half_a_finger_before_the_joint(everyday_skin: Synthesiser) -> None:
    """Frame 0 shows the open hand from the front, so that its joints are in view."""
    made = everyday_skin
    reach = measured_reach(keypoints_of(made, 0), made.sensor.camera, depth_of(made, 0), 0.006)
    behind = np.linalg.norm(made.joints[0], axis=-1) - reach
    joints = np.setdiff1d(np.arange(21), [0, 4, 8, 12, 16, 20])
    assert np.median(np.abs(behind - half_thickness(made.options.hand))[joints]) < 0.003


def test_readings_that_no_hand_spans_are_not_lifted(lifter: Lifter, everyday_skin: Synthesiser) -> None:
    """In a wrong unit of depth, each reading may be far from the median of all."""
    camera, keypoints = everyday_skin.sensor.camera, keypoints_of(everyday_skin, 0)
    known = np.arange(21) < 20
    keypoints = replace(keypoints, confidence=np.where(known, keypoints.confidence, 0.0))
    middle = np.median(keypoints.pixels[known, 0])
    depth = np.tile(np.where(np.arange(camera.width) < middle, 100.0, 500.0), (camera.height, 1)).astype(np.float32)
    reach = measured_reach(keypoints, camera, depth, LiftOptions().window)[known]
    assert np.abs(reach - np.nanmedian(reach)).min() > 1
    assert lifter.lift(keypoints, camera, depth) is None
