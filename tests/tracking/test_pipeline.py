"""Tests of the ROI prior that tracking gives to the segmentation."""

from dataclasses import replace

import numpy as np
import pytest

from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.segmentation.hand_size import AVERAGE_HAND
from depthtrack.tracking.guided_segmentation import roi_prior


def test_without_a_pose_there_is_no_prior() -> None:
    assert roi_prior(HandModel(HandShape()), None) is None


def test_the_prior_has_the_reach_of_the_hand_and_an_average_palm() -> None:
    model = HandModel(HandShape(scale=0.7))
    pose = np.zeros(27)
    pose[2], pose[3] = 0.5, 1.0
    prior = roi_prior(model, pose)
    assert prior is not None
    assert prior.hand == replace(AVERAGE_HAND, reach=prior.hand.reach)
    assert prior.hand.reach == pytest.approx(0.7 * AVERAGE_HAND.reach)
    np.testing.assert_array_equal(prior.centre, pose[:3])


def test_the_hand_ends_at_the_wrist_on_the_far_side_of_the_palm() -> None:
    model = HandModel(HandShape())
    pose = np.zeros(27)
    pose[2], pose[3] = 0.5, 1.0
    prior = roi_prior(model, pose)
    assert prior is not None
    np.testing.assert_allclose(prior.wrist.normal, [0.0, -1.0, 0.0], atol=1e-12)
    assert prior.wrist.point[1] < pose[1]
