"""A doubtful start tries other places of the hand."""

import math
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from depthtrack.hand.kinematics import HandModel
from depthtrack.recording.frame_failures import failure_text
from depthtrack.recording.sequence import Frame
from depthtrack.segmentation.morphology import bounding_box
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.segmentation.roi_tracking import RoiPrior
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.synthesis.generate import Synthesis, Synthesiser
from depthtrack.tracking import guided_segmentation
from depthtrack.tracking.options import TrackingThresholds
from depthtrack.tracking.pipeline import Pipeline, TrackedFrame, replay_frames, track_frames
from depthtrack.tracking.registry import create_tracker, tracker_config

CLUTTERED = Synthesis(motion="everyday", sensor="kinect1", background="room", model="skin", seed=22)
NEVER = TrackingThresholds(
    start_shifts=(), start_bends=(), start_oppositions=(), start_confidence=0, start_energy=math.inf
)


@pytest.fixture(scope="module")
def made() -> Synthesiser:
    return Synthesiser(Synthesis(motion="everyday", model="skin", forearm=True, frames=4))


class ForearmFirst(Segmenter):
    """Segmenter that takes the forearm for the hand, with the hand as the alternative."""

    def __init__(self, made: Synthesiser) -> None:
        super().__init__(None)
        self._made = made

    def segment(self, frame: Frame, prior: RoiPrior | None = None) -> Observation | None:
        right = super().segment(frame, prior)
        if prior is not None or right is None:
            return right
        forearm = (frame.depth > 0) & ~self._made[frame.index].mask
        region = bounding_box(forearm, 10)
        depth = np.where(forearm, frame.depth, np.float32(0))[region.slices]
        camera = frame.camera.crop(region)
        v, u = np.nonzero(depth)
        centre = camera.unproject(np.stack([u, v], axis=-1), depth[v, u]).mean(axis=0)
        there = replace(right, camera=camera, silhouette=depth > 0, depth=depth, surroundings=None)
        return replace(there, region=region, centre=centre, wrist=None)

    def alternatives(self, frame: Frame, first: Observation) -> Iterator[Observation]:
        right = Segmenter(None).segment(frame)
        assert right is not None
        yield replace(right, cost=0.05)


def frames_of(made: Synthesiser) -> list[Frame]:
    frames = [made[index] for index in range(len(made))]
    return [
        Frame(index, frame.timestamp, frame.depth.astype(np.float32), None, made.sensor.camera)
        for index, frame in enumerate(frames)
    ]


def track(
    made: Synthesiser, name: str, segmenter: Segmenter, thresholds: TrackingThresholds | None = None
) -> list[TrackedFrame]:
    hand, config = made.options.hand, tracker_config(name)
    if thresholds is not None:
        config = replace(config, thresholds=thresholds)
    with closing(create_tracker(config, hand)) as tracker:
        return list(track_frames(frames_of(made), Pipeline(tracker, segmenter, hand)))


def error(made: Synthesiser, each: TrackedFrame) -> float:
    """Return the mean error of the keypoints, metres."""
    assert each.estimate.pose is not None
    points = HandModel(made.options.hand).keypoints(each.estimate.pose)
    return float(np.linalg.norm(points - made[each.frame.index].joints, axis=-1).mean())


@pytest.mark.parametrize("name", ["hybrid", "ik", pytest.param("pso", marks=pytest.mark.slow)])
def test_a_start_on_the_forearm_finds_the_hand(made: Synthesiser, name: str) -> None:
    tracked = track(made, name, ForearmFirst(made))
    assert max(error(made, each) for each in tracked) < 0.005
    assert all(each.estimate.status.is_trusted for each in tracked)


def test_without_alternatives_it_stays_there(made: Synthesiser) -> None:
    first, *_ = track(made, "ik", ForearmFirst(made), NEVER)
    assert error(made, first) > 0.05


def test_the_frame_is_segmented_around_the_start_in_a_replay_too(made: Synthesiser) -> None:
    first, *_ = tracked = track(made, "ik", ForearmFirst(made))
    assert first.observation is not None
    assert first.observation.resegmentation is None
    with closing(create_tracker(tracker_config("ik"), made.options.hand)) as guide:
        pairs = [(each.frame, each.estimate) for each in tracked]
        replayed = replay_frames(pairs, guide, ForearmFirst(made), made.options.hand)
        for each, again in zip(tracked, replayed, strict=True):
            assert each.observation is not None
            assert again.observation is not None
            assert again.observation.region == each.observation.region
            np.testing.assert_array_equal(again.observation.depth, each.observation.depth)


class FailsAroundTheStart(ForearmFirst):
    """Segmenter that fails near any pose."""

    def segment(self, frame: Frame, prior: RoiPrior | None = None) -> Observation | None:
        if prior is not None:
            raise np.linalg.LinAlgError("singular")
        return super().segment(frame, prior)


def test_a_failure_around_the_start_is_recorded(made: Synthesiser, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guided_segmentation, "failure_text", failure_text)
    first, *_ = track(made, "ik", FailsAroundTheStart(made))
    assert first.failure is not None
    assert "singular" in first.failure
    assert error(made, first) < 0.005


def test_alternatives_leave_the_state_of_the_segmenter() -> None:
    made = Synthesiser(replace(CLUTTERED, frames=2))
    frames = [replace(frame, colour=made[frame.index].colour) for frame in frames_of(made)]
    usual, asked = (Segmenter.from_options(SegmentationOptions(), True) for _ in range(2))
    for frame in frames:
        one, other = usual.segment(frame), asked.segment(frame)
        assert one is not None
        assert other is not None
        np.testing.assert_array_equal(one.silhouette, other.silhouette)
        found = list(asked.alternatives(frame, other))
        assert all(each.cost >= 0 for each in found)
        assert all(each.frame_index == frame.index for each in found)


def test_the_first_palm_is_tried_away_from_the_forearm() -> None:
    made = Synthesiser(replace(CLUTTERED, frames=1))
    frame = replace(frames_of(made)[0], colour=made[0].colour)
    segmenter = Segmenter.from_options(SegmentationOptions(), True)
    first = segmenter.segment(frame)
    assert first is not None
    assert first.arm_direction is not None
    steps = [
        float((first.centre - each.centre) @ first.arm_direction)
        for each in segmenter.alternatives(frame, first)
        if each.cost == 0
    ]
    np.testing.assert_allclose(steps[:2], [0.04, 0.08], atol=0.005)
