"""A recording played as a live source, at its own rate or frame by frame."""

import time
from collections.abc import Callable, Iterator

import numpy as np

from depthtrack.closing import Closing
from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.geometry.camera import Camera
from depthtrack.live.frames import LiveFrame
from depthtrack.live.late_frames import LateFrames
from depthtrack.recording.sequence import Sequence


class PlayedRecording(Closing):
    """Delivers the frames of a recording as a sensor does.

    In real time, a frame arrives at its time stamp, counted from the first frame. Frames that arrive while the last one
    is tracked are dropped as `LateFrames` chooses. Damaged frames are dropped too. The latency of a late frame includes
    the time to read it.
    """

    def __init__(
        self,
        recording: Sequence,
        realtime: bool = True,
        late: LateFrames | None = None,
        *,
        clock: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        """Make a source; its time starts with the iteration.

        realtime: play at the rate of the recording; otherwise deliver every frame when it is asked for.
        late: choice of the frames to drop.

        Raises:
            InputError: the recording has no depth images.
        """
        if not recording.has_depth:
            raise InputError(f"{recording.name} must have depth images to be played, found none")
        self._recording, self._realtime, self._late = recording, realtime, late or LateFrames()
        self._clock, self._sleep = clock, sleep

    @property
    def name(self) -> str:
        """Name of the recording."""
        return self._recording.name

    @property
    def camera(self) -> Camera:
        """Camera of the depth images."""
        return self._recording.camera

    def __iter__(self) -> Iterator[LiveFrame]:
        times = self._recording.timestamps - self._recording.timestamps[0]
        start, number = self._clock(), 0
        last: float | None = None
        while number < len(times):
            if self._realtime:
                arrived = int(np.searchsorted(times, self._clock() - start, side="right"))
                number += self._late.choose(times[number : max(arrived, number + 1)], last)
            try:
                frame = self._recording[number]
            except DamagedFrameError:
                number += 1
                continue
            arrival = start + float(times[number]) if self._realtime else self._clock()
            if (wait := arrival - self._clock()) > 0:
                self._sleep(wait)
            last = float(times[number])
            yield LiveFrame(number, frame.timestamp, frame.depth, frame.colour, arrival)
            number += 1

    def close(self) -> None:
        """See `LiveSource`; a recording stays open."""
