"""A film of a run: every frame with the hypothesis over it."""

from collections.abc import Callable, Iterable
from pathlib import Path

from depthtrack.evaluation.replay import Replay, ReplayedFrame
from depthtrack.viewing.contact_sheet import frame_rate
from depthtrack.viewing.run_pictures import RunPainter
from depthtrack.viewing.video import VideoWriter

Progress = Callable[[Iterable[ReplayedFrame]], Iterable[ReplayedFrame]]


def write_run_film(
    replay: Replay,
    path: Path,
    codecs: tuple[str, ...] | None = None,
    height: int = 360,
    progress: Progress | None = None,
    speed: float = 1.0,
) -> int:
    """Write an mp4 (or webm) of a run at its own pace times `speed`, complete or not at all; returns how many frames.

    `height` pixels of each of the four views; frames stream. Raises InputError.
    """
    painter = RunPainter(replay, height)
    replayed: Iterable[ReplayedFrame] = replay if progress is None else progress(replay)
    with VideoWriter(path, speed * (frame_rate(replay.sequence) or 30.0), codecs) as writer:
        for seen in replayed:
            writer.write(painter.picture(seen))
    return writer.frame_count
