"""The live loop reports latency and dropped frames on any clock."""

from collections.abc import Iterator
from typing import Any, cast

import numpy as np
import pytest

from depthtrack.api.live import HandTracker
from depthtrack.hand.one_euro import OneEuroFilter
from depthtrack.hand.pose import make_pose
from depthtrack.live.frames import LiveFrame
from depthtrack.live.late_frames import LateFrames
from depthtrack.live.played_recording import PlayedRecording
from depthtrack.live.tracking import LiveReport, track_live
from depthtrack.recording.status import Status
from depthtrack.tracking.tracker import Estimate
from tests.live.test_played_recording import CountedFrames, FakeClock


class BusyTracker:
    """Takes some seconds a frame, and returns a pose that moves with the frame's number."""

    def __init__(self, clock: FakeClock, seconds: list[float]) -> None:
        self.clock, self.seconds, self.calls = clock, iter(seconds), 0

    def update(self, depth: Any, colour: Any, *, timestamp: float) -> Estimate:
        self.clock.now += next(self.seconds)
        self.calls += 1
        if depth[0, 0] == 3:
            return Estimate(None, float("nan"), 0.0, Status.ABSENT, {}, timestamp)
        pose = make_pose([0.01 * float(depth[0, 0]), 0, 0.5], [1, 0, 0, 0], np.zeros(20))
        return Estimate(pose, 1.0, 1.0, Status.TRACKED, {}, timestamp)


def test_latency_and_drops_are_those_of_the_clock() -> None:
    clock = FakeClock()
    tracker = BusyTracker(clock, [0.03, 0.03, 0.25, 0.05, 0.05])
    source = PlayedRecording(CountedFrames(6), late=LateFrames(longest_step=0.2), clock=clock, sleep=clock.sleep)
    report = LiveReport()
    found = list(track_live(source, cast(HandTracker, tracker), clock=clock))
    for each in found:
        report.add(each)
    assert [each.frame.number for each in found] == [0, 1, 2, 4, 5]
    assert [each.dropped for each in found] == [0, 0, 0, 1, 0]
    # Frame 4 arrived while frame 2 was tracked, 0.05 s before it was taken.
    np.testing.assert_allclose([each.latency for each in found], [0.03, 0.03, 0.25, 0.10, 0.05])
    fields = report.to_fields()
    assert (fields["frames"], fields["dropped"], fields["trusted"]) == (5, 1, 5)
    assert fields["latency_ms"] == {"median": pytest.approx(50), "p95": pytest.approx(220)}
    assert report.text() == (
        "5 frames tracked, 1 dropped (16.7 %); 5 with a trusted pose; "
        "latency 50.0 ms (median), 220.0 ms (95th percentile)"
    )


def test_frames_that_are_not_newer_are_dropped() -> None:
    clock, depth = FakeClock(), np.ones((3, 4), np.float32)

    def repeated() -> Iterator[LiveFrame]:
        for number, timestamp in ((0, 1.0), (0, 1.0), (1, 1.0), (2, 0.9), (3, 1.2)):
            yield LiveFrame(number, timestamp, depth, None, clock())

    tracker = BusyTracker(clock, [0.0] * 5)
    found = list(track_live(repeated(), cast(HandTracker, tracker), clock=clock))
    assert [each.frame.number for each in found] == [0, 3]
    assert [each.dropped for each in found] == [0, 2]


def test_poses_are_filtered_if_asked() -> None:
    def poses(smooth: OneEuroFilter | None) -> list[Any]:
        clock = FakeClock()
        source = PlayedRecording(CountedFrames(6), realtime=False, clock=clock)
        tracker = cast(HandTracker, BusyTracker(clock, [0.01] * 6))
        return [each.pose for each in track_live(source, tracker, smooth=smooth, clock=clock)]

    raw, filtered = poses(None), poses(OneEuroFilter())
    assert raw[3] is filtered[3] is None
    np.testing.assert_array_equal(raw[0], filtered[0])
    assert raw[2][0] > filtered[2][0] > raw[1][0] - 0.01


def test_an_empty_run_has_no_latency() -> None:
    assert LiveReport().text() == "no frame arrived"
    assert LiveReport().to_fields()["latency_ms"] == {"median": None, "p95": None}
