"""The IK tracker: accuracy on the skin and on the cylinder model, start by itself, and the same bits when resumed."""

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.evaluation.metrics import angle_error, endpoint_error
from depthtrack.hand.kinematics import HandModel
from depthtrack.synthesis.generate import Synthesis, Synthesiser
from depthtrack.tracking.ik.surfaces import Model
from depthtrack.tracking.ik.tracker import IkOptions, IkTracker
from depthtrack.tracking.tracker import Estimate, Status
from depthtrack.tracking.trackers import create_tracker
from tests.synthetic_observations import observe

MADE = Synthesiser(Synthesis(model="skin"))
MODEL = HandModel(MADE.options.hand)


def follow(tracker: IkTracker, frames: range) -> list[Estimate]:
    first, *rest = frames
    return [tracker.start(observe(MADE, first), MADE.poses[first])] + [tracker.track(observe(MADE, i)) for i in rest]


@pytest.mark.parametrize(("model", "highest_mm", "highest_deg"), [("skin", 2.0, 2.0), ("cylinders", 5.0, 6.0)])
def test_follows_everyday_motion_rendered_from_the_skin(model: Model, highest_mm: float, highest_deg: float) -> None:
    """Five ICP iterations on a third of the points, as Schroeder et al. 2014 measure."""
    frames = range(100, 140)
    estimates = follow(IkTracker(MADE.options.hand, IkOptions(model=model)), frames)
    poses, truth = np.array([estimate.pose for estimate in estimates]), MADE.poses[frames.start : frames.stop]
    assert endpoint_error(MODEL, poses, MODEL, truth).values.mean() < highest_mm
    assert angle_error(poses, truth).values.mean() < highest_deg
    assert {estimate.status for estimate in estimates[1:]} == {Status.TRACKED}


def test_starts_by_itself() -> None:
    estimate = IkTracker(MADE.options.hand).track(observe(MADE, 10))
    assert estimate.status is Status.STARTED
    assert estimate.pose is not None
    assert endpoint_error(MODEL, estimate.pose[None], MODEL, MADE.poses[10:11]).values[0] < 40


def test_a_tracker_that_recalls_goes_on_with_the_same_bits() -> None:
    whole = follow(IkTracker(MADE.options.hand), range(0, 8))
    resumed = IkTracker(MADE.options.hand)
    resumed.recall(whole[:5])
    for index in range(5, 8):
        np.testing.assert_array_equal(resumed.track(observe(MADE, index)).pose, whole[index].pose)


def test_trackers_are_made_by_name() -> None:
    assert create_tracker("ik", MADE.options.hand, subsample=5).name == "ik"
    assert create_tracker("pso", MADE.options.hand, particles=8).name == "pso"
    with pytest.raises(InputError, match="choose one of pso, ik"):
        create_tracker("magic", MADE.options.hand)
    with pytest.raises(InputError, match="particles"):
        create_tracker("ik", MADE.options.hand, particles=8)
