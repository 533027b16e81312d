"""Depth stored as video: the whole numbers of each frame, with random access."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.recording.video_frames import VideoFrames, library, open_video, video_stream
from depthtrack.types import Array

FEWEST_BITS = 10
"""Bits of a sample below which depth has lost its meaning."""


class DepthVideo:
    """A video of one channel of 10 to 16 bits.

    width, height: pixels.
    pixel_format: FFmpeg's name, as "gray12le".
    bits: of a sample.
    times: (N,) seconds, increasing.
    truncated: the header states more frames, or a longer duration, than there are.
    """

    def __init__(self, path: Path, number: int = 0) -> None:
        """List the frames of a video stream, by its number among those.

        Raises:
            InputError: if the file is no video, or its frames are colours of 8 bits.
            MissingExtraError: if PyAV is not installed.
        """
        self.path, av = path, library()
        try:
            with open_video(path) as container:
                self.pixel_format, self.bits = _checked_format(video_stream(container, path, number), path)
        except av.FFmpegError as error:
            raise InputError(f"{path} cannot be read as a video: {error.strerror}") from error
        self._frames = VideoFrames(path, number)
        self.width, self.height = self._frames.width, self._frames.height
        self.times: Array = self._frames.times
        self.truncated = self._frames.truncated

    def read(self, index: int) -> NDArray[np.uint16]:
        """Return the samples (h, w) of a frame.

        Raises:
            DamagedFrameError: if it cannot be decoded.
        """
        frame = self._frames.read(index)
        if frame.format.name != self.pixel_format:
            raise DamagedFrameError(
                f"{self.path}: frame {index} must be {self.pixel_format}, found {frame.format.name}"
            )
        plane = frame.planes[0]
        kind = "<u2" if self.pixel_format.endswith("le") else ">u2"
        samples = np.frombuffer(plane, kind).reshape(self.height, plane.line_size // 2)
        return samples[:, : self.width].astype(np.uint16)


def sample_format(stream: Any) -> tuple[str, int]:
    """Return FFmpeg's name of the pixel format of a stream, and the bits of its first channel."""
    pixel_format = stream.codec_context and stream.codec_context.format
    return (str(pixel_format.name), int(pixel_format.components[0].bits)) if pixel_format else ("unknown", 0)


def _checked_format(stream: Any, path: Path) -> tuple[str, int]:
    """Return the pixel format and the bits of its first channel.

    Raises:
        InputError: if it cannot hold depth.
    """
    name, bits = sample_format(stream)
    # The first channel of a planar format lies alone; YUV of 10 bits and more holds depth in its luma.
    is_planar = name.startswith("gray") or (name.startswith("yuv") and name.endswith("le"))
    if bits < FEWEST_BITS or not is_planar:
        raise InputError(
            f"{path} must hold depth as gray12le or gray16le, found {name}: in colours of 8 bits depth has lost its"
            " meaning, so record it again"
        )
    return name, bits
