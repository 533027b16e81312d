"""Writing of recordings as MCAP files, which Foxglove, rerun and ROS 2 open.

Depth is 16UC1 in millimetres if that is the recording's unit, else 32FC1 in metres (ROS REP 118).
"""

import shutil
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from depthtrack.errors import InputError, MissingExtraError
from depthtrack.files import replace_atomically
from depthtrack.geometry.camera import Camera
from depthtrack.recording.bags.cameras import MILLIMETRE
from depthtrack.types import Depth, Image

DEPTH_TOPIC, COLOUR_TOPIC = "/camera/depth/image_raw", "/camera/color/image_raw"
_INFO_TOPICS = ("/camera/depth/camera_info", "/camera/color/camera_info")
_UNIT_TOPIC = "/camera/depth/option/Depth_Units/value"
_FRAME = "camera"
"""Coordinate frame of depth and colour, which is registered to it."""


class McapWriter:
    """Context manager that writes an `.mcap` file, complete or absent.

        with McapWriter(path, camera) as writer:
            writer.append(timestamp, depth, colour)

    Raises:
        InputError: if the file exists, or cannot be written.
        MissingExtraError: if rosbags is not installed.
    """

    def __init__(self, path: Path | str, camera: Camera, overwrite: bool = False) -> None:
        self._path, self._camera, self._overwrite = Path(path), camera, overwrite
        self._connections: dict[str, Any] = {}
        self._last: int | None = None

    def __enter__(self) -> Self:
        try:
            from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
            from rosbags.typesys import Stores, get_typestore
        except ImportError as error:
            raise MissingExtraError("writing MCAP files", "bags") from error
        if self._path.exists() and not self._overwrite:
            raise InputError(
                f"{self._path} exists already: choose another name, or use --overwrite (Python: overwrite=True)"
            )
        self._replacing = replace_atomically(self._path)
        self._temporary = self._replacing.__enter__()
        # rosbags writes a folder; its MCAP file is complete on its own, and holds the name of the folder.
        self._parts = self._temporary.with_suffix(".parts")
        shutil.rmtree(self._parts, ignore_errors=True)
        self._parts.mkdir()
        self._folder = self._parts / self._path.stem
        self._types = get_typestore(Stores.ROS2_HUMBLE)
        self._writer = Writer(self._folder, version=8, storage_plugin=StoragePlugin.MCAP)
        self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        self._writer.open()
        return self

    def append(self, timestamp: float, depth: Depth, colour: Image | None = None) -> None:
        """Add a frame.

        timestamp: seconds, increasing, not negative.
        depth: (h, w) metres, 0 = none.
        colour: (h, w, 3) RGB registered to the depth.

        Raises:
            InputError: if the time does not increase, or an image has another size than the camera.
        """
        time = round(timestamp * 1e9)
        if time < 0 or (self._last is not None and time <= self._last):
            raise InputError(f"timestamps of an MCAP file must increase from 0 s, found {timestamp:g} s")
        if depth.shape != self._camera.shape or (colour is not None and colour.shape != (*self._camera.shape, 3)):
            raise InputError(f"images must have the camera's shape {self._camera.shape}, found {depth.shape}")
        if self._last is None:
            self._describe(time)
        self._last = time
        units = self._camera.depth_scale
        if units == MILLIMETRE:
            stored = np.rint(depth / units)
            image = self._image(time, np.where(stored <= np.iinfo(np.uint16).max, stored, 0).astype("<u2"), "16UC1")
        else:
            image = self._image(time, depth.astype("<f4"), "32FC1")
        self._write(DEPTH_TOPIC, image, time)
        self._write(_INFO_TOPICS[0], self._info(time), time)
        if colour is not None:
            self._write(COLOUR_TOPIC, self._image(time, colour, "rgb8"), time)
            self._write(_INFO_TOPICS[1], self._info(time), time)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None and self._last is None:
                raise InputError(f"a recording needs at least one frame, found none for {self._path}")
            self._writer.close()
            if kind is None:
                (written,) = self._folder.glob("*.mcap")
                written.replace(self._temporary)
        finally:
            shutil.rmtree(self._parts, ignore_errors=True)
            self._replacing.__exit__(None, None, None)

    def _describe(self, time: int) -> None:
        """Write the step of the depth."""
        self._write(_UNIT_TOPIC, self._message("std_msgs/msg/Float32", data=self._camera.depth_scale), time)

    def _write(self, topic: str, message: Any, time: int) -> None:
        kind = message.__msgtype__
        if topic not in self._connections:
            self._connections[topic] = self._writer.add_connection(topic, kind, typestore=self._types)
        self._writer.write(self._connections[topic], time, self._types.serialize_cdr(message, kind))

    def _message(self, kind: str, **fields: Any) -> Any:
        return self._types.types[kind](**fields)

    def _header(self, time: int) -> Any:
        stamp = self._message("builtin_interfaces/msg/Time", sec=time // 10**9, nanosec=time % 10**9)
        return self._message("std_msgs/msg/Header", stamp=stamp, frame_id=_FRAME)

    def _image(self, time: int, pixels: Any, encoding: str) -> Any:
        data = np.ascontiguousarray(pixels)
        return self._message(
            "sensor_msgs/msg/Image",
            header=self._header(time),
            height=data.shape[0],
            width=data.shape[1],
            encoding=encoding,
            is_bigendian=0,
            step=data.strides[0],
            data=data.view(np.uint8).ravel(),
        )

    def _info(self, time: int) -> Any:
        camera, K = self._camera, self._camera.matrix
        return self._message(
            "sensor_msgs/msg/CameraInfo",
            header=self._header(time),
            height=camera.height,
            width=camera.width,
            distortion_model="plumb_bob",
            d=np.zeros(5),
            k=K.ravel(),
            r=np.eye(3).ravel(),
            p=np.column_stack([K, np.zeros(3)]).ravel(),
            binning_x=0,
            binning_y=0,
            roi=self._message(
                "sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
            ),
        )
