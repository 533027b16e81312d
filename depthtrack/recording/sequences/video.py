"""Videos with depth: `.mkv` of Azure Kinect and Femto, and others with a camera given.

| stream     | Azure Kinect and Femto                        | other videos                              |
|------------|-----------------------------------------------|-------------------------------------------|
| depth      | titled DEPTH, b16g, millimetres               | the first of one channel and 10 to 16 bits |
| colour     | titled COLOR: MJPEG, NV12 or YUY2             | not read                                  |
| attachment | calibration.json: both cameras, transform     |                                           |
"""

from pathlib import Path
from typing import Any

import numpy as np

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.files import open_regular
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.distortion import Undistortion
from depthtrack.geometry.registration import Registration
from depthtrack.recording.azure_calibration import AzureCalibration, CalibratedCamera
from depthtrack.recording.colour_association import associate_colour
from depthtrack.recording.depth_video import FEWEST_BITS, DepthVideo, sample_format
from depthtrack.recording.reading import ReadingOptions
from depthtrack.recording.sequences.base import BaseSequence
from depthtrack.recording.video_frames import VideoFrames, library, open_video
from depthtrack.types import Depth, Image

_MATROSKA, _MP4, _RIFF = b"\x1a\x45\xdf\xa3", b"ftyp", b"RIFF"
_SEGMENT = b"\x18\x53\x80\x67"
"""Identifier of the element that holds the streams."""
_HEAD_BYTES = 4096


class VideoSequence(BaseSequence):
    """A video with a depth stream. Colour is read where the file states both cameras."""

    format_name = "a video with 16-bit depth (.mkv of Azure Kinect or Femto, FFV1)"
    is_generic = True

    def _open(self, camera: Camera | None) -> None:
        """See `BaseSequence`.

        Raises:
            InputError: if no stream holds depth, or its camera is unknown and none is given.
            MissingExtraError: if PyAV is not installed.
        """
        streams = _Streams(self.path)
        self._video = DepthVideo(self.path, streams.depth)
        self.timestamps = self._video.times
        size = (self._video.width, self._video.height)
        own = None if streams.calibration is None else streams.calibration.depth(size, str(self.path))
        if camera is None and own is None:
            raise InputError(
                f"{self.path} describes no camera: give it with --camera FILE.json, --camera-preset NAME,"
                " or --fx and --depth-scale"
            )
        self.camera = camera or own.camera  # type: ignore[union-attr]
        if self._video.truncated or _is_unfinished(self.path):
            self.notes.append(
                f"{self.path.name} is cut short, or was not finished: the {len(self.timestamps)} frames in it are read"
            )
        distortion = own.distortion if camera is None and own is not None else None
        self._undistortion = Undistortion.needed(self.camera, distortion)
        if self._undistortion is not None:
            self.notes.append(self._undistortion.note)
        self._last: tuple[int, Depth] | None = None
        self._colour: VideoFrames | None = None
        self._registration: Registration | None = None
        self._partner: dict[int, int] = {}
        if streams.colour is not None and not self.reading.depth_only:
            self._open_colour(streams, own)
        self.has_colour = bool(self._partner)

    @classmethod
    def matches(cls, path: Path) -> bool:
        """See `BaseSequence`."""
        if not path.is_file():
            return False
        head = _head(path)
        return head.startswith(_MATROSKA) or head[4:8] == _MP4 or (head.startswith(_RIFF) and head[8:12] == b"AVI ")

    @classmethod
    def image_size(cls, path: Path, reading: ReadingOptions | None = None) -> tuple[int, int]:
        """See `BaseSequence`."""
        video = DepthVideo(path, _Streams(path).depth)
        return video.width, video.height

    def read_depth(self, index: int) -> Depth:
        """See `BaseSequence`."""
        # Colour is registered with the depth that was read just before.
        if self._last is not None and self._last[0] == index:
            return self._last[1]
        stored = self._video.read(index)
        if stored.shape != self.camera.shape:
            raise DamagedFrameError(
                f"{self.path} must have the camera's {self.camera.width}x{self.camera.height} pixels,"
                f" found {self._video.width}x{self._video.height}"
            )
        depth = self.camera.metres(stored)
        if self._undistortion is not None:
            depth = self._undistortion.depth(depth)
        self._last = (index, depth)
        return depth

    def read_colour(self, index: int) -> Image | None:
        """See `BaseSequence`."""
        if self._colour is None or self._registration is None or index not in self._partner:
            return None
        frame = self._colour.read(self._partner[index])
        return self._registration(self.read_depth(index), frame.to_ndarray(format="rgb24"))

    def _open_colour(self, streams: "_Streams", depth: CalibratedCamera | None) -> None:
        """Pair colour with depth and register it, or note why depth is read alone."""
        if streams.calibration is None or depth is None or streams.colour is None:
            self.notes.append("colour is not used, depth is read alone: the file does not describe both cameras")
            return
        try:
            video = VideoFrames(self.path, streams.colour)
            colour = streams.calibration.colour((video.width, video.height), str(self.path))
            T = colour.T_camera_reference @ np.linalg.inv(depth.T_camera_reference)
            self._registration = Registration(self.camera, colour.camera, T, colour.distortion)
        except InputError as error:
            self.notes.append(f"colour is not used, depth is read alone: {error}")
            return
        association = associate_colour(self.timestamps, video.times)
        self._colour, self._partner = video, association.partner
        self.notes.append("colour is registered to the depth with the cameras that the file describes")
        if association.note is not None:
            self.notes.append(association.note)


class _Streams:
    """Numbers of the video streams with depth and colour, and the attached calibration."""

    def __init__(self, path: Path) -> None:
        """Read the header. Raises InputError if no stream holds depth."""
        av = library()
        try:
            with open_video(path) as container:
                videos = list(container.streams.video)
                titles = [str(stream.metadata.get("title", "")).upper() for stream in videos]
                formats = [sample_format(stream) for stream in videos]
                attached = [stream for stream in container.streams if stream.type == "attachment"]
                described = [_content(stream) for stream in attached if str(stream.name).endswith("calibration.json")]
        except av.FFmpegError as error:
            raise InputError(f"{path} cannot be read as a video: {error.strerror}") from error
        deep = [bits >= FEWEST_BITS and name.startswith("gray") for name, bits in formats]
        depths = [number for number, is_deep in enumerate(deep) if is_deep and titles[number] != "IR"]
        if not depths:
            listed = ", ".join(name for name, _ in formats) or "none"
            raise InputError(
                f"{path} must hold a stream of depth with one channel of {FEWEST_BITS} to 16 bits, found {listed}:"
                " depth that was turned into colours has lost its meaning, so record it again"
            )
        self.depth = next((number for number in depths if titles[number] == "DEPTH"), depths[0])
        colours = [number for number, is_deep in enumerate(deep) if not is_deep and titles[number] != "IR"]
        self.colour = next((number for number in colours if titles[number] == "COLOR"), next(iter(colours), None))
        self.calibration = AzureCalibration.parse(described[0], str(path)) if described else None


def _content(stream: Any) -> bytes:
    return bytes(stream.data or b"")


def _head(path: Path) -> bytes:
    with open_regular(path) as file:
        return file.read(_HEAD_BYTES)


def _is_unfinished(path: Path) -> bool:
    """Return whether a Matroska file ends before its header states, or states no end."""
    head = _head(path)
    place = head.find(_SEGMENT)
    if not head.startswith(_MATROSKA) or place < 0 or place + 12 > len(head):
        return False
    field = head[place + 4 : place + 12]
    # The place of the first bit that is set states the length of a number; all others set stand for no size.
    length = max(1, 9 - field[0].bit_length())
    largest = (1 << 7 * length) - 1
    size = int.from_bytes(field[:length], "big") & largest
    return size == largest or place + 4 + length + size > path.stat().st_size
