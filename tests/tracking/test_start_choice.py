"""The choice of a start: when other places are tried, and which one costs least."""

import math
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.hand.kinematics import HandModel
from depthtrack.recording.sequence import Frame
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.synthesis.generate import Synthesis, Synthesiser
from depthtrack.tracking.guided_segmentation import segment_start
from depthtrack.tracking.options import TrackingThresholds
from depthtrack.tracking.registry import create_tracker, tracker_config
from depthtrack.tracking.stage_tracker import StageTracker
from depthtrack.tracking.start_choice import Start, is_doubtful, start_cost, tries_places
from depthtrack.types import Array

OPTIONS = TrackingThresholds()
NEVER = TrackingThresholds(start_confidence=0, start_energy=math.inf)
STARTS = st.builds(Start, st.floats(0, 3), st.floats(0, 1), st.floats(0, 1))


@given(STARTS, st.floats(0, 1), st.floats(0, 1), st.floats(0, 1))
def test_more_energy_less_confidence_and_a_farther_place_cost_more(
    start: Start, energy: float, confidence: float, place: float
) -> None:
    worse = Start(start.energy + energy, max(start.confidence - confidence, 0), start.place + place)
    assert start_cost(worse, OPTIONS) >= start_cost(start, OPTIONS)
    assert is_doubtful(worse, OPTIONS) or not is_doubtful(start, OPTIONS)


@given(STARTS)
def test_a_start_without_readings_around_it_is_doubtful_and_costs_most(start: Start) -> None:
    nothing = Start(math.inf, 0.0, 0.0)
    assert is_doubtful(nothing, OPTIONS)
    assert start_cost(nothing, OPTIONS) > start_cost(start, OPTIONS)


def test_trackers_of_papers_try_no_places() -> None:
    for name in ("oikonomidis2011", "schroeder2014"):
        assert not tries_places(tracker_config(name).thresholds)
    assert not is_doubtful(Start(math.inf, 0.0, 0.0), NEVER)
    assert tries_places(OPTIONS)


class Around:
    """Other observations of one frame: none elsewhere, and a given one around any pose."""

    def __init__(self, observation: Observation | None) -> None:
        self._observation = observation

    def elsewhere(self) -> Iterator[Observation]:
        return iter(())

    def around(self, pose: Array) -> Observation | None:
        return self._observation


def test_a_start_is_judged_where_its_pose_is() -> None:
    """Readings that are missing around the pose raise its energy."""
    made = Synthesiser(Synthesis(motion="everyday", model="skin", frames=1))
    depth = made[0].depth.astype(np.float32)
    frame = Frame(0, 0.0, depth, None, made.sensor.camera)
    hand, config = made.options.hand, tracker_config("ik")
    with closing(create_tracker(config, hand)) as tracker:
        assert isinstance(tracker, StageTracker)
        whole = segment_start(frame, Segmenter(None), HandModel(hand))
        assert whole is not None
        pose = made[0].pose
        right = tracker.start_at(pose, 0.1, Around(whole))
        assert right.place == 0.1
        assert right.energy < 0.15
        cut = depth.copy()
        cut[:, : whole.region.left + (whole.region.right - whole.region.left) // 2] = 0
        half = Segmenter(None).segment(replace(frame, depth=cut))
        assert tracker.start_at(pose, 0.0, Around(half)).energy > 3 * right.energy
        assert tracker.start_at(pose, 0.0, Around(None)) == Start(math.inf, 0.0, 0.0)
