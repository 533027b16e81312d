"""No pose is scored twice in a frame, and any renderer serves any tracker."""

import numpy as np
import pytest

from depthtrack.hand.shape import HandShape
from depthtrack.recording.status import Status
from depthtrack.rendering.scorer import Scores
from depthtrack.synthesis.generate import Synthesiser
from depthtrack.tracking.frame import Toolkit
from depthtrack.tracking.registry import create_tracker, tracker_config
from tests.support.observations import observe

SMALLEST_SWARM = 32
"""Particles."""


@pytest.mark.parametrize("name", ["hybrid", "ik", "pso", "schroeder2014", "oikonomidis2011"])
def test_no_call_scores_a_pose_that_an_earlier_call_scored(
    everyday_skin: Synthesiser, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[set[bytes]] = []
    original = Toolkit.set_target

    def counting(tools: Toolkit, observation: object) -> None:
        original(tools, observation)  # type: ignore[arg-type]
        calls.clear()
        evaluate = type(tools.scorer).evaluate.__get__(tools.scorer)

        def counted(poses: np.ndarray) -> Scores:
            calls.append({np.asarray(pose).tobytes() for pose in poses})
            return evaluate(poses)

        monkeypatch.setattr(tools.scorer, "evaluate", counted)

    monkeypatch.setattr(Toolkit, "set_target", counting)
    tracker = create_tracker(tracker_config(name), HandShape())
    tracker.start(observe(everyday_skin, 20), everyday_skin.poses[20])
    for index in (21, 22, 60):
        tracker.track(observe(everyday_skin, index))
        assert calls
        for number, call in enumerate(calls):
            # A particle that stands still is scored in each generation of its swarm.
            if len(call) < SMALLEST_SWARM:
                assert not call & set().union(*calls[:number])


@pytest.mark.parametrize("name", ["hybrid", "ik", "schroeder2014"])
def test_another_renderer_serves_a_tracker(everyday_skin: Synthesiser, name: str) -> None:
    """The oracle: slow, but everywhere; it must lead to nearly the same pose as the rasteriser."""
    poses = []
    for renderer in ("raster", "oracle"):
        config = tracker_config(name, renderer=renderer, resolution=32)
        tracker = create_tracker(config, HandShape())
        tracker.start(observe(everyday_skin, 20), everyday_skin.poses[20])
        estimate = tracker.track(observe(everyday_skin, 21))
        assert estimate.status is Status.TRACKED
        assert estimate.pose is not None
        poses.append(estimate.pose)
    np.testing.assert_allclose(poses[0], poses[1], atol=0.01)
