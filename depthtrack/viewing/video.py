"""Atomic writing of video files by OpenCV's encoder."""

import os
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import TracebackType
from typing import Self

import cv2
import numpy as np

from depthtrack.errors import InputError, is_text
from depthtrack.files import replace_atomically
from depthtrack.types import Image

QUICK_CODECS = ("avc1", "mp4v")
"""H.264 if OpenCV has it (macOS, distributions), else MPEG-4 part 2: fast, for every video player."""

WEB_CODECS = ("avc1", "vp09")
"""H.264, else VP9: also for browsers; VP9 takes about thirty times longer to encode."""

WEBM_CODECS = ("VP80",)
"""VP8 in .webm files: for browsers, with a sixth of VP9's encoding time."""


class VideoWriter:
    """Write RGB images (h, w, 3) uint8 as an mp4 or webm video; use as a context manager.

    All images must have the first one's size, which is rounded down to even numbers. The file appears if the block
    succeeds. If the block fails or writes no image, no file is left.

    rate: frames a second.
    codecs: codecs in order of preference; None for the default of the suffix.
    Raises: InputError if suffix or rate are invalid.
    """

    def __init__(self, path: Path, rate: float, codecs: tuple[str, ...] | None = None) -> None:
        if path.suffix.lower() not in (".mp4", ".webm"):
            raise InputError(f"a video file must end in .mp4 (or .webm), found '{path.name}'")
        if not is_text(str(path)):
            raise InputError(f"the path of a video must be UTF-8 text, found {str(path)[:80]!r}: choose another name")
        if not (np.isfinite(rate) and rate > 0):
            raise InputError(f"the frame rate of a video must be positive, found {rate!r}")
        self.path = path
        self.rate = rate
        self.codecs = codecs or (QUICK_CODECS if path.suffix.lower() == ".mp4" else WEBM_CODECS)
        self.frame_count = 0
        self._cleanup = ExitStack()
        self._shape: tuple[int, ...] = ()
        self._encoder: cv2.VideoWriter | None = None

    def write(self, image: Image) -> None:
        """Append one image (h, w, 3).

        Raises: InputError if no codec works, or if the size differs from the first image's.
        """
        if self._encoder is None:
            self._shape = image.shape
            self._encoder = self._open_encoder(image.shape[1] // 2 * 2, image.shape[0] // 2 * 2)
        if image.shape != self._shape:
            raise InputError(f"every image of a video must have the shape {self._shape}, found {image.shape}")
        height, width = image.shape[0] // 2 * 2, image.shape[1] // 2 * 2
        self._encoder.write(np.ascontiguousarray(image[:height, :width, ::-1]))
        self.frame_count += 1

    def __enter__(self) -> Self:
        self._temporary = self._cleanup.enter_context(replace_atomically(self.path))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._cleanup.push(self._finish)
        self._cleanup.__exit__(kind, error, trace)

    def _finish(self, kind: type[BaseException] | None, *_: object) -> None:
        if self._encoder is not None:
            self._encoder.release()
            if kind is None:
                self._check_complete()

    def _check_complete(self) -> None:
        """Raise InputError if the file has fewer images than were written.

        OpenCV does not report a full disk.
        """
        reader = cv2.VideoCapture(str(self._temporary))
        held = round(reader.get(cv2.CAP_PROP_FRAME_COUNT))
        reader.release()
        if held != self.frame_count:
            raise InputError(
                f"the video {self.path} must hold {self.frame_count} images, found {held}: check the disk's free space"
            )

    def _open_encoder(self, width: int, height: int) -> cv2.VideoWriter:
        """Return an encoder with the first codec that this build of OpenCV supports."""
        # FFmpeg reports every unsupported codec on stderr; it reads this variable once, at first use.
        os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
        for codec in self.codecs:
            fourcc = cv2.VideoWriter.fourcc(*codec)
            with _silent_stderr():
                encoder = cv2.VideoWriter(str(self._temporary), fourcc, self.rate, (width, height))
            if encoder.isOpened():
                return encoder
            self._temporary.unlink(missing_ok=True)
        raise InputError(
            f"this OpenCV ({cv2.__version__}) can encode none of {', '.join(self.codecs)} at {width}x{height}: "
            "install opencv-python-headless from PyPI, or write a contact sheet instead"
        )


@contextmanager
def _silent_stderr() -> Iterator[None]:
    """Discard the output of C libraries on stderr.

    FFmpeg reports each tag that webm does not support.
    """
    sys.stderr.flush()
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)
