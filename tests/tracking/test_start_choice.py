"""The choice of a start: when other places are tried, and which one costs least."""

import math
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import ANGLES, make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.shape import HandShape
from depthtrack.recording.sequence import Frame
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.synthesis.generate import Synthesis, Synthesiser
from depthtrack.tracking.candidate import Candidate
from depthtrack.tracking.configuration import HybridConfig
from depthtrack.tracking.frame import FrameContext, Toolkit
from depthtrack.tracking.guided_segmentation import segment_start
from depthtrack.tracking.options import TrackingThresholds
from depthtrack.tracking.registry import create_tracker, tracker_config
from depthtrack.tracking.stage_tracker import StageTracker
from depthtrack.tracking.start_choice import (
    Start,
    StartChoice,
    bent_further,
    is_doubtful,
    moved_along_hand,
    opposed_further,
    start_cost,
    tries_places,
)
from depthtrack.tracking.trackers.hybrid import hybrid
from depthtrack.types import Array

OPTIONS = TrackingThresholds()
NEVER = TrackingThresholds(
    start_shifts=(), start_bends=(), start_oppositions=(), start_confidence=0, start_energy=math.inf
)
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


@given(STARTS, st.floats(0, 1), st.floats(0, 1))
def test_a_start_that_explains_little_of_its_observation_is_doubtful(
    start: Start, observed: float, less: float
) -> None:
    assert is_doubtful(start, OPTIONS, 0.0)
    assert is_doubtful(start, OPTIONS) == is_doubtful(start, OPTIONS, 1.0)
    assert is_doubtful(start, OPTIONS, observed * less) or not is_doubtful(start, OPTIONS, observed)


class Proposed(NamedTuple):
    """Proposal with a confidence in its observation."""

    candidate: Candidate
    confidence: float
    place: float = 0.0


def test_a_start_on_the_forearm_tries_other_places() -> None:
    """It explains the region around it, but little of its first observation."""
    hand, forearm = np.zeros(27), np.ones(27)
    tried = list[Array]()

    def found(pose: Array, confidence: float) -> Proposed:
        tried.append(pose)
        return Proposed(Candidate(pose, 0.01, 0.8), confidence)

    choice = StartChoice[Proposed](
        replace(OPTIONS, start_shifts=(), start_bends=(), start_oppositions=()),
        search=lambda other: found(hand, 0.8),
        refine=lambda around, pose: None,
        judge=lambda pose, place, _: Start(0.3 if pose is hand else 0.45, 0.8 if pose is hand else 0.7, place),
    )

    class Elsewhere(Around):
        def elsewhere(self) -> Iterator[Observation]:
            return iter([None])  # type: ignore[list-item]

    best = choice.best(found(forearm, 0.04), Elsewhere(None))
    assert best.candidate.pose is hand
    assert len(tried) == 2
    assert choice.best(found(forearm, 0.9), Elsewhere(None)).candidate.pose is forearm
    assert len(tried) == 3


def test_trackers_of_papers_try_no_places_moves_or_bends() -> None:
    for name in ("oikonomidis2011", "schroeder2014"):
        thresholds = tracker_config(name).thresholds
        assert not tries_places(thresholds)
        assert (thresholds.start_shifts, thresholds.start_bends, thresholds.start_oppositions) == ((), (), ())
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


@given(st.floats(-0.1, 0.1))
def test_a_move_along_the_hand_moves_all_joints_from_the_wrist_to_the_fingers(shift: float) -> None:
    model, pose = HandModel(HandShape()), make_pose([0.1, 0.2, 0.5], [0.5, -0.1, 0.7, 0.5], POSTURES["open"])
    wrist, knuckle = model.keypoints(pose)[[0, 9]]
    moves = model.keypoints(moved_along_hand(pose, shift)) - model.keypoints(pose)
    np.testing.assert_allclose(moves, np.broadcast_to(moves[0], moves.shape), atol=1e-12)
    assert np.linalg.norm(moves[0]) == pytest.approx(abs(shift), abs=1e-12)
    assert moves[0] @ (knuckle - wrist) * shift >= 0


@given(st.floats(-3, 3))
def test_a_bend_turns_the_joints_of_the_fingers_alone_and_within_the_limits(angle: float) -> None:
    pose = make_pose([0.1, 0.2, 0.5], [0.5, -0.1, 0.7, 0.5], POSTURES["open"])
    bent = bent_further(pose, angle)
    np.testing.assert_array_equal(bent, within_limits(bent))
    before, after = (each[ANGLES].reshape(5, 4) for each in (within_limits(pose), bent))
    np.testing.assert_array_equal(before[0], after[0])
    np.testing.assert_array_equal(before[:, 0], after[:, 0])
    np.testing.assert_array_equal(pose[: ANGLES.start], bent[: ANGLES.start])
    changes = (after - before)[1:, 1:]
    assert np.all(changes * np.sign(angle) >= 0)
    assert np.all(np.abs(changes) <= abs(angle) + 1e-12)


@given(st.floats(-3, 3))
def test_an_opposition_turns_the_thumb_alone_and_within_the_limits(angle: float) -> None:
    pose = make_pose([0.1, 0.2, 0.5], [0.5, -0.1, 0.7, 0.5], POSTURES["open"])
    opposed = opposed_further(pose, angle)
    np.testing.assert_array_equal(opposed, within_limits(opposed))
    before, after = (each[ANGLES].reshape(5, 4) for each in (within_limits(pose), opposed))
    np.testing.assert_array_equal(before[1:], after[1:])
    np.testing.assert_array_equal(pose[: ANGLES.start], opposed[: ANGLES.start])
    assert np.all((after - before)[0] * np.sign(angle) >= 0)


class Found:
    """Stage that finds a pose."""

    name = "search"

    def __init__(self, pose: Array) -> None:
        self._pose = pose

    def __call__(self, frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]:
        return frame.evaluate(self._pose[None])


@pytest.mark.parametrize("slide", [-0.03, 0.03])
def test_a_hand_that_slid_along_its_forearm_is_moved_back(slide: float) -> None:
    made = Synthesiser(Synthesis(motion="everyday", model="skin", forearm=True, frames=1))
    frame = Frame(0, 0.0, made[0].depth.astype(np.float32), None, made.sensor.camera)
    hand, config = made.options.hand, HybridConfig()
    moves = replace(NEVER, start_shifts=config.thresholds.start_shifts)
    errors = []
    for thresholds in (moves, NEVER):
        tools = Toolkit(hand, config.scoring)
        stages = replace(hybrid(config, tools), start=[Found(moved_along_hand(made[0].pose, slide))])
        with closing(StageTracker("hybrid", stages, tools, thresholds, 0)) as tracker:
            observation = segment_start(frame, Segmenter(None), HandModel(hand))
            assert observation is not None
            pose = tracker.start(observation).pose
            assert pose is not None
            errors.append(float(np.linalg.norm(HandModel(hand).keypoints(pose) - made[0].joints, axis=-1).mean()))
    assert errors[0] < 0.003
    assert errors[1] > 0.02


def test_a_start_with_stretched_fingers_is_bent() -> None:
    """The fingers of a half-open hand are found stretched; the fit alone leaves them so."""
    made = Synthesiser(Synthesis(motion="grasp", model="skin", forearm=True, frames=60))
    index = len(made) - 1
    frame = Frame(0, 0.0, made[index].depth.astype(np.float32), None, made.sensor.camera)
    hand, config = made.options.hand, HybridConfig()
    errors = []
    for bends in ((0.5,), ()):
        tools = Toolkit(hand, config.scoring)
        stages = replace(hybrid(config, tools), start=[Found(bent_further(made[index].pose, -0.6))])
        tracker = StageTracker("hybrid", stages, tools, replace(NEVER, start_bends=bends), 0)
        with closing(tracker):
            observation = segment_start(frame, Segmenter(None), HandModel(hand))
            assert observation is not None
            pose = tracker.start(observation).pose
            assert pose is not None
            errors.append(float(np.linalg.norm(HandModel(hand).keypoints(pose) - made[index].joints, axis=-1).mean()))
    assert errors[0] < 0.5 * errors[1]
