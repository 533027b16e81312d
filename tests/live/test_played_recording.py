"""A recording plays at its own rate on any clock; late requests drop frames."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.geometry.camera import Camera
from depthtrack.live.frames import LiveFrame
from depthtrack.live.late_frames import LateFrames
from depthtrack.live.played_recording import PlayedRecording
from depthtrack.recording.reading import ReadingOptions
from depthtrack.recording.sequences.base import BaseSequence
from depthtrack.types import Depth

CAMERA = Camera(4, 3, 5.0, 5.0, 1.5, 1.0, 0.001)


class CountedFrames(BaseSequence):
    """A recording whose depth is the number of the frame, at 10 Hz from 100 s on."""

    def __init__(self, frames: int, damaged: tuple[int, ...] = (), clock: "FakeClock | None" = None) -> None:
        self.timestamps = np.linspace(100, 100 + 0.1 * (frames - 1), frames)
        self.bad, self.clock = damaged, clock
        super().__init__(Path("counted"))

    def _open(self, camera: Camera | None) -> None:
        self.camera = CAMERA

    @classmethod
    def matches(cls, path: Path) -> bool:
        return False

    @classmethod
    def image_size(cls, path: Path, reading: ReadingOptions | None = None) -> tuple[int, int]:
        return 4, 3

    def read_depth(self, index: int) -> Depth:
        if self.clock is not None:
            self.clock.now += 0.01
        if index in self.bad:
            raise DamagedFrameError("broken")
        return np.full((3, 4), index, dtype=np.float32)


@dataclass
class FakeClock:
    """A clock that moves by its sleep, and by what a test adds."""

    now: float = 7.0
    slept: list[float] = field(default_factory=list)

    def __call__(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.slept.append(seconds)
        self.now += seconds


def played(
    recording: CountedFrames, clock: FakeClock, busy: list[float], realtime: bool = True, late: LateFrames | None = None
) -> list[LiveFrame]:
    """Return the frames of a consumer that is busy after each; the last value repeats."""
    frames, times = [], iter(busy)
    for frame in PlayedRecording(recording, realtime, late, clock=clock, sleep=clock.sleep):
        frames.append(frame)
        clock.now += next(times, busy[-1])
    return frames


def test_a_fast_consumer_gets_every_frame_on_time() -> None:
    clock = FakeClock()
    frames = played(CountedFrames(5, clock=clock), clock, [0.03])
    assert [frame.number for frame in frames] == [0, 1, 2, 3, 4]
    np.testing.assert_allclose([frame.arrival for frame in frames], 7 + 0.1 * np.arange(5))
    np.testing.assert_allclose([frame.timestamp for frame in frames], 100 + 0.1 * np.arange(5))
    # Frames are read before they are due, so only the rest of the interval is slept.
    np.testing.assert_allclose(clock.slept, [0.05, 0.06, 0.06, 0.06])
    assert [int(frame.depth[0, 0]) for frame in frames] == [0, 1, 2, 3, 4]


def test_after_a_search_a_fast_consumer_catches_up_with_small_gaps() -> None:
    """The first frame takes 0.65 s; none is more than 0.2 s after the last."""
    clock = FakeClock()
    frames = played(CountedFrames(12), clock, [0.65, 0.02], late=LateFrames(longest_step=0.2))
    assert [frame.number for frame in frames] == [0, 2, 4, 6, 7, 8, 9, 10, 11]
    np.testing.assert_allclose([frame.arrival for frame in frames[:4]], 7 + 0.1 * np.array([0, 2, 4, 6]))


def test_a_consumer_that_is_too_slow_goes_on_from_the_newest_frame() -> None:
    clock = FakeClock()
    frames = played(CountedFrames(40), clock, [1.25])
    assert [frame.number for frame in frames] == [0, 12, 25, 37, 38, 39]


def test_a_consumer_that_is_late_by_the_whole_recording_gets_the_last_frame() -> None:
    assert [frame.number for frame in played(CountedFrames(20), FakeClock(), [99.0])] == [0, 19]


def test_damaged_frames_are_dropped() -> None:
    assert [frame.number for frame in played(CountedFrames(6, (0, 3)), FakeClock(), [0.0])] == [1, 2, 4, 5]


def test_frame_by_frame_nothing_is_dropped_and_nobody_waits() -> None:
    clock = FakeClock()
    frames = played(CountedFrames(4, (1,)), clock, [5.0], realtime=False)
    assert [frame.number for frame in frames] == [0, 2, 3]
    assert [frame.arrival for frame in frames] == [7, 12, 17]
    assert clock.slept == []


def test_a_recording_without_depth_is_refused() -> None:
    recording = CountedFrames(2)
    recording.has_depth = False
    with pytest.raises(InputError, match="counted must have depth images"):
        PlayedRecording(recording)
