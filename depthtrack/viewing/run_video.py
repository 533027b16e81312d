"""The video of a run: every frame with the hypothesis over it."""

from collections.abc import Callable, Iterable
from pathlib import Path

from depthtrack.evaluation.replay import Replay, ReplayedFrame
from depthtrack.viewing.contact_sheet import frame_rate
from depthtrack.viewing.run_pictures import RunPainter
from depthtrack.viewing.video import VideoWriter

Progress = Callable[[Iterable[ReplayedFrame]], Iterable[ReplayedFrame]]
"""Wraps an iterator of frames, for a progress bar."""


def write_run_video(
    replay: Replay,
    path: Path,
    codecs: tuple[str, ...] | None = None,
    height: int = 360,
    progress: Progress | None = None,
    speed: float = 1.0,
) -> int:
    """Write a run as an mp4 or webm video, atomically, and return the number of frames.

    height: of each of the four views, pixels.
    speed: playback speed relative to the recording.
    Raises: InputError if a frame cannot be read or the video cannot be written.
    """
    painter = RunPainter(replay, height)
    replayed: Iterable[ReplayedFrame] = replay if progress is None else progress(replay)
    with VideoWriter(path, speed * (frame_rate(replay.sequence) or 30.0), codecs) as writer:
        for frame in replayed:
            writer.write(painter.picture(frame))
    return writer.frame_count
