"""Frames of a RealSense camera, or of its recorded file, by pyrealsense2.

It needs the extra `realsense`.
"""

import importlib
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from depthtrack.closing import Closing
from depthtrack.errors import InputError, MissingExtraError
from depthtrack.geometry.camera import Camera
from depthtrack.live.frames import LiveFrame

_TIMEOUT_MS = 5000
_FILE_TIMEOUT_MS = 1000
"""Longest pause of a camera and of a file, milliseconds."""


class RealSenseSource(Closing):
    """A camera that streams depth and colour; the colour is registered to the depth.

    The driver drops frames that are not read in time, which shows in their numbers: see `queue_frames`.
    """

    def __init__(
        self,
        serial: str | None = None,
        size: tuple[int, int] = (640, 480),
        rate: int = 30,
        *,
        file: Path | None = None,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        """Start a camera.

        serial: serial number; the first camera if absent.
        size: width and height of the images, pixels.
        rate: frames a second, Hz.
        file: recorded file to play in place of a camera, at its own rate.

        Raises:
            InputError: there is no such camera, it has no such images, or the file cannot be played.
            MissingExtraError: pyrealsense2 is not installed.
        """
        rs = realsense_library()
        self._clock = clock
        self._pipeline, config = rs.pipeline(), rs.config()
        if file is not None:
            config.enable_device_from_file(str(file), repeat_playback=False)
        else:
            config.enable_device(_chosen_camera(rs, serial))
            config.enable_stream(rs.stream.depth, *size, rs.format.z16, rate)
            config.enable_stream(rs.stream.color, *size, rs.format.rgb8, rate)
        try:
            profile = self._pipeline.start(config)
        except RuntimeError as error:
            wanted = file or f"a RealSense camera with images of {size[0]} x {size[1]} at {rate} Hz"
            advice = "is it a recording of a RealSense camera?" if file else "is it connected, and used by no one else?"
            raise InputError(f"cannot start {wanted}: {error}; {advice}") from error
        device = profile.get_device()
        named = device.supports(rs.camera_info.name)
        self.name = str(device.get_info(rs.camera_info.name)) if named else "RealSense"
        self._is_file = file is not None
        self._has_colour = any(each.stream_type() == rs.stream.color for each in profile.get_streams())
        stream = profile.get_stream(rs.stream.depth).as_video_stream_profile()
        scale = float(device.first_depth_sensor().get_depth_scale())
        self.camera = camera_of(stream.get_intrinsics(), scale)
        self._align = rs.align(rs.stream.depth)
        self._streaming = True

    def __iter__(self) -> Iterator[LiveFrame]:
        """Yield frames until the source is closed, or the file ends.

        Raises:
            InputError: the camera delivers no more frames.
        """
        last = -1
        while self._streaming:
            found, frames = self._pipeline.try_wait_for_frames(_FILE_TIMEOUT_MS if self._is_file else _TIMEOUT_MS)
            arrival = self._clock()
            if not found and self._is_file:
                return
            if not found:
                waited = f"{_TIMEOUT_MS / 1000:g} s"
                raise InputError(f"{self.name} must deliver frames, found none in {waited}: is it connected?")
            frames = self._align.process(frames) if self._has_colour else frames
            depth, colour = frames.get_depth_frame(), frames.get_color_frame()
            # The driver repeats the depth image if only the colour image is new.
            if not depth or depth.get_frame_number() <= last or (self._has_colour and not colour):
                continue
            last = int(depth.get_frame_number())
            image = np.asanyarray(colour.get_data()).copy() if colour else None
            yield LiveFrame(last, depth.get_timestamp() / 1000, np.asanyarray(depth.get_data()).copy(), image, arrival)

    def close(self) -> None:
        """Stop the camera."""
        if self._streaming:
            self._streaming = False
            self._pipeline.stop()


def _chosen_camera(rs: Any, serial: str | None) -> str:
    """Return the serial number of a connected camera. Raises InputError if there is none."""
    connected = [str(device.get_info(rs.camera_info.serial_number)) for device in rs.context().query_devices()]
    if not connected:
        raise InputError("no RealSense camera is connected: connect one, or give a recording as the source")
    if serial is not None and serial not in connected:
        raise InputError(f"no RealSense camera has the serial number {serial}: choose one of {', '.join(connected)}")
    return serial or connected[0]


def camera_of(intrinsics: Any, depth_scale: float) -> Camera:
    """Return the camera of RealSense intrinsics; their depth images have no distortion."""
    return Camera(
        intrinsics.width,
        intrinsics.height,
        float(intrinsics.fx),
        float(intrinsics.fy),
        float(intrinsics.ppx),
        float(intrinsics.ppy),
        depth_scale,
    )


def realsense_library() -> Any:
    """Import pyrealsense2.

    Raises:
        MissingExtraError: if it is not installed.
    """
    try:
        return importlib.import_module("pyrealsense2")
    except ImportError as error:
        raise MissingExtraError("a RealSense camera", "realsense") from error
