"""Depth stored as video: the whole numbers of each frame, with random access.

The packets are listed once, without decoding. A frame is decoded from the key frame before it, or from the frame that
was read last.
"""

import threading
from bisect import bisect_right
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthtrack.errors import DamagedFrameError, InputError, MissingExtraError
from depthtrack.geometry.camera import MAX_SIDE
from depthtrack.recording.sequences.tum_lists import MAX_FRAMES
from depthtrack.types import Array

_MICROSECONDS = 1e6
_FEWEST_BITS = 10
"""Bits of a sample below which depth has lost its meaning."""
_SHORT_CUT = 60
"""Frames that are decoded one after the other before a search for a key frame is faster."""
_MOST_INCOMPLETE = 32
"""Most frames before a cut that refer to frames behind it."""
_EARLIER_KEYS = 3
"""Key frames at or before a frame from which it is decoded, before the whole video is."""


class DepthVideo:
    """A video of one channel of 10 to 16 bits.

    width, height: pixels.
    pixel_format: FFmpeg's name, as "gray12le".
    bits: of a sample.
    times: (N,) seconds, increasing.
    truncated: the header states more frames, or a longer duration, than there are.
    """

    def __init__(self, path: Path) -> None:
        """List the frames of the first video stream.

        Raises:
            InputError: if the file is no video, or its frames are colours of 8 bits.
            MissingExtraError: if PyAV is not installed.
        """
        self.path = path
        self._av = _library()
        try:
            with self._av.open(str(path)) as container:
                stream = _video_stream(container, path)
                self.width, self.height = stream.codec_context.width, stream.codec_context.height
                self.pixel_format, self.bits = _checked_format(stream, path)
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

    def read(self, index: int) -> NDArray[np.uint16]:
        """Return the samples (h, w) of a frame.

        Raises:
            DamagedFrameError: if it cannot be decoded.
        """
        with self._lock:
            try:
                frame = self._decoded(index)
            except self._av.FFmpegError as error:
                self._next = -1
                raise DamagedFrameError(f"{self.path}: frame {index} is damaged: {error.strerror}") from error
        if frame is None or (frame.width, frame.height) != (self.width, self.height):
            raise DamagedFrameError(f"{self.path}: frame {index} cannot be decoded")
        if frame.format.name != self.pixel_format:
            raise DamagedFrameError(
                f"{self.path}: frame {index} must be {self.pixel_format}, found {frame.format.name}"
            )
        plane = frame.planes[0]
        samples = np.frombuffer(plane, "<u2").reshape(self.height, plane.line_size // 2)
        return samples[:, : self.width].astype(np.uint16)

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
        with self._av.open(str(self.path)) as container:
            stream = container.streams.video[0]
            container.seek(time, stream=stream)
            yield from container.decode(stream)


def _library() -> Any:
    try:
        import av
    except ImportError as error:
        raise MissingExtraError("depth in videos", "video") from error
    return av


def _video_stream(container: Any, path: Path) -> Any:
    if not container.streams.video:
        raise InputError(f"{path} must hold a video stream, found none")
    return container.streams.video[0]


def _checked_format(stream: Any, path: Path) -> tuple[str, int]:
    """Return the pixel format and the bits of its first channel.

    Raises:
        InputError: if it cannot hold depth.
    """
    pixel_format = stream.codec_context.format
    name, bits = (str(pixel_format.name), int(pixel_format.components[0].bits)) if pixel_format else ("unknown", 0)
    if bits < _FEWEST_BITS or not name.startswith(("gray", "yuv")) or not name.endswith("le"):
        raise InputError(
            f"{path} must hold depth as gray12le or gray16le, found {name}: in colours of 8 bits depth has lost its"
            " meaning, so record it again"
        )
    return name, bits


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
