"""Frames of a sensor, read in a thread while others are tracked."""

import threading
from collections import deque
from collections.abc import Iterable, Iterator

from depthtrack.live.frames import LiveFrame
from depthtrack.live.late_frames import LateFrames


def queue_frames(frames: Iterable[LiveFrame], late: LateFrames | None = None) -> Iterator[LiveFrame]:
    """Yield frames of a source that blocks until the next one; drop those that are late.

    The source is read in a thread from the first request on. Frames that are older than `late.longest_delay` are not
    kept, so memory is bounded. An error of the source is raised here.
    """
    late = late or LateFrames()
    waiting: deque[LiveFrame] = deque()
    changed, ended = threading.Condition(), threading.Event()
    failure: list[BaseException] = []

    def read() -> None:
        try:
            for frame in frames:
                with changed:
                    waiting.append(frame)
                    while frame.timestamp - waiting[0].timestamp > late.longest_delay:
                        waiting.popleft()
                    changed.notify()
                if ended.is_set():
                    return
        except BaseException as error:
            failure.append(error)
        finally:
            with changed:
                ended.set()
                changed.notify()

    thread = threading.Thread(target=read, name="live-frames", daemon=True)
    thread.start()
    last: float | None = None
    try:
        while True:
            with changed:
                changed.wait_for(lambda: waiting or ended.is_set())
                if not waiting:
                    break
                chosen = late.choose([frame.timestamp for frame in waiting], last)
                for _ in range(chosen):
                    waiting.popleft()
                frame = waiting.popleft()
            last = frame.timestamp
            yield frame
        if failure:
            raise failure[0]
    finally:
        ended.set()
