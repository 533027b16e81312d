"""The hybrid tracker: accuracy on both kinds of synthetic hand, and resuming."""

import numpy as np
import pytest

from depthtrack.evaluation.metrics import endpoint_error
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.recording.status import Status
from depthtrack.synthesis.generate import Synthesiser
from depthtrack.tracking.configuration import HybridConfig
from depthtrack.tracking.frame import FrameContext, Toolkit
from depthtrack.tracking.registry import create_tracker
from depthtrack.tracking.stages.surface_choice import FitChosenSurface
from depthtrack.tracking.stages.surface_fit import SurfaceFit
from depthtrack.tracking.state import TrackState
from depthtrack.tracking.tracker import Estimate
from tests.support.observations import observe

MODEL = HandModel(HandShape())


def follow(made: Synthesiser, frames: range) -> list[Estimate]:
    tracker, (first, *rest) = create_tracker(HybridConfig(), HandShape()), frames
    return [tracker.start(observe(made, first), made.poses[first]), *(tracker.track(observe(made, i)) for i in rest)]


@pytest.mark.parametrize("hand", ["everyday", "everyday_skin"])
def test_joints_are_accurate_on_both_kinds_of_hand(hand: str, request: pytest.FixtureRequest) -> None:
    made: Synthesiser = request.getfixturevalue(hand)
    frames = range(100, 130)
    estimates = follow(made, frames)
    poses = np.array([estimate.pose for estimate in estimates])
    assert endpoint_error(MODEL, poses, MODEL, made.poses[frames.start : frames.stop]).values.mean() < 1.0
    assert {estimate.status for estimate in estimates[1:]} == {Status.TRACKED}


@pytest.mark.parametrize(("hand", "surface"), [("everyday", "primitives"), ("everyday_skin", "skin")])
def test_the_surface_that_was_drawn_is_chosen(hand: str, surface: str, request: pytest.FixtureRequest) -> None:
    made: Synthesiser = request.getfixturevalue(hand)
    config = HybridConfig()
    tools = Toolkit(HandShape(), config.scoring)
    stage = FitChosenSurface(config.surface_choice, SurfaceFit(config.fit))
    for index in range(0, 300, 30):
        observation = observe(made, index)
        tools.set_target(observation)
        frame = FrameContext(observation, tools, TrackState(config.thresholds, 40.0), 0)
        stage(frame, frame.evaluate(made.poses[[index]]))
        assert frame.surface == surface


def test_a_restored_tracker_returns_the_same_bits(everyday: Synthesiser) -> None:
    whole = follow(everyday, range(60, 68))
    resumed = create_tracker(HybridConfig(), HandShape())
    resumed.restore(whole[:5])
    for number, estimate in enumerate(whole[5:], start=65):
        np.testing.assert_array_equal(resumed.track(observe(everyday, number)).pose, estimate.pose)
