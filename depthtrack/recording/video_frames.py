"""Frames of a video by their number, with random access and bounded memory.

The packets are listed once, without decoding. A frame is decoded from the key frame before it, or from the frame that
was read last.
"""

import threading
from bisect import bisect_right
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from depthtrack.errors import DamagedFrameError, InputError, MissingExtraError
from depthtrack.geometry.camera import MAX_SIDE
from depthtrack.recording.sequences.tum_lists import MAX_FRAMES
from depthtrack.types import Array

_MICROSECONDS = 1e6
_SHORT_CUT = 60
"""Frames that are decoded one after the other before a search for a key frame is faster."""
_MOST_INCOMPLETE = 32
"""Most frames before a cut that refer to frames behind it."""
_EARLIER_KEYS = 3
"""Key frames at or before a frame from which it is decoded, before the whole video is."""


class VideoFrames:
    """The frames of one stream of a video.

    width, height: pixels.
    times: (N,) seconds, increasing.
    truncated: the header states more frames, or a longer duration, than there are.
    """

    def __init__(self, path: Path, number: int = 0) -> None:
        """List the frames of a video stream, by its number among those.

        Raises:
            InputError: if the file is no video, or the stream has no frame.
            MissingExtraError: if PyAV is not installed.
        """
        self.path, self._number = path, number
        self._av = library()
        try:
            with open_video(path) as container:
                stream = video_stream(container, path, number)
                self.width, self.height = stream.codec_context.width, stream.codec_context.height
                self._times, self._keys = _listed(container, stream, path)
                times: Array = np.array([float(pts * stream.time_base) for pts in self._times])
                self.truncated = stream.frames > len(times) or _lasts_longer(container, times)
        except self._av.FFmpegError as error:
            raise InputError(
                f"{path} cannot be read as a video: {error.strerror}: if it is cut short, its list of frames is lost"
            ) from error
        if not (1 <= self.width <= MAX_SIDE and 1 <= self.height <= MAX_SIDE):
            raise InputError(f"{path} must have sides up to {MAX_SIDE} pixels, found {self.width}x{self.height}")
        if len(self._times) == 0:
            raise InputError(f"{path} holds no frame")
        self._lock = threading.Lock()
        self._frames: Iterator[Any] = iter(())
        self._next = -1
        if self.truncated:
            self._drop_incomplete()
        self.times = times[: len(self._times)]

    def read(self, index: int) -> Any:
        """Return a decoded frame of PyAV.

        Raises:
            DamagedFrameError: if it cannot be decoded, or has another size than the stream.
        """
        with self._lock:
            try:
                frame = self._decoded(index)
            except self._av.FFmpegError as error:
                self._next = -1
                raise DamagedFrameError(f"{self.path}: frame {index} is damaged: {error.strerror}") from error
        if frame is None or (frame.width, frame.height) != (self.width, self.height):
            raise DamagedFrameError(f"{self.path}: frame {index} cannot be decoded")
        return frame

    def _drop_incomplete(self) -> None:
        """Drop the last frames if the cut took what they refer to."""
        for index in range(len(self._times) - 1, max(0, len(self._times) - _MOST_INCOMPLETE), -1):
            try:
                self.read(index)
                return
            except DamagedFrameError:
                del self._times[index]

    def _decoded(self, index: int) -> Any | None:
        """Return the decoded frame; None if the stream has none of its time."""
        wanted = self._times[index]
        frame = self._forward(wanted) if 0 <= self._next <= index <= self._next + _SHORT_CUT else None
        # A frame may be stored behind the key frame that follows it, and is then decoded from an earlier one.
        before = bisect_right(self._keys, wanted)
        for key in (*reversed(self._keys[max(0, before - _EARLIER_KEYS) : before]), self._times[0]):
            if frame is None:
                self._frames = self._from(key)
                frame = self._forward(wanted)
        self._next = -1 if frame is None else index + 1
        return frame

    def _forward(self, wanted: int) -> Any | None:
        """Return the frame of a time among those still to be decoded, or None."""
        for frame in self._frames:
            if frame.pts is not None and frame.pts >= wanted:
                return frame if frame.pts == wanted else None
        return None

    def _from(self, time: int) -> Iterator[Any]:
        """Yield the decoded frames from the key frame at or before a time."""
        with open_video(self.path) as container:
            stream = container.streams.video[self._number]
            container.seek(time, stream=stream)
            yield from container.decode(stream)


def library() -> Any:
    """Return the module av. Raises MissingExtraError."""
    try:
        import av
    except ImportError as error:
        raise MissingExtraError("depth in videos", "video") from error
    return av


def open_video(path: Path) -> Any:
    """Return a file that PyAV has opened; text in it that is not UTF-8 is ignored.

    Raises InputError if it is no regular file, MissingExtraError, or an error of PyAV.
    """
    av = library()
    if not path.is_file():  # FFmpeg would wait for the writer of a pipe
        raise InputError(f"{path} is missing or no regular file")
    # PyAV 19 keeps text that is not UTF-8, and has no choice.
    choices = {"metadata_errors": "ignore"} if int(av.__version__.partition(".")[0]) < 19 else {}
    return av.open(str(path), **choices)


def video_stream(container: Any, path: Path, number: int = 0) -> Any:
    """Return a video stream of an opened file by its number. Raises InputError."""
    if len(container.streams.video) <= number:
        raise InputError(f"{path} must hold a video stream, found none")
    stream = container.streams.video[number]
    if stream.codec_context is None:
        raise InputError(f"{path} must hold a video stream of a known codec, found an unknown one")
    return stream


def _lasts_longer(container: Any, times: Array) -> bool:
    """Return whether the stated duration exceeds the times (N,) by three frames."""
    if container.duration is None or len(times) < 2:
        return False
    begin = (container.start_time or 0) / _MICROSECONDS
    return bool(begin + container.duration / _MICROSECONDS - times[-1] > 3 * np.median(np.diff(times)))


def _listed(container: Any, stream: Any, path: Path) -> tuple[list[int], list[int]]:
    """Return the times of all complete packets and of key frames, increasing.

    Both are in units of the stream.
    """
    times: set[int] = set()
    keys: set[int] = set()
    for packet in container.demux(stream):
        if packet.pts is None or packet.size == 0 or packet.is_corrupt:
            continue
        times.add(packet.pts)
        if packet.is_keyframe:
            keys.add(packet.pts)
        if len(times) > MAX_FRAMES:
            raise InputError(f"{path} holds more than {MAX_FRAMES:,} frames: split it")
    return sorted(times), sorted(keys)
