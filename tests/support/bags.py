"""Bags written by the library rosbags, for the tests of their reader."""

import shutil
import struct
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from depthtrack.geometry.camera import Camera

Container = Literal["bag", "db3", "mcap"]
ORBBEC_PROFILE = "custom_msg/msg/StreamProfileInfo"
_ORBBEC_DEFINITION = """std_msgs/Header header
uint8 streamType
uint8 format
uint8 distortionModel
float32[4] cameraIntrinsic
float32[8] cameraDistortion
uint32 width
uint32 height
float32 fps
float32[9] rotationMatrix
float32[3] translationMatrix
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
"""


@dataclass
class Bag:
    """Messages to write: (topic, seconds, message type, fields); `frame_id` asks for a header."""

    rows: list[tuple[str, float, str, dict[str, Any]]] = field(default_factory=list)

    def add(self, topic: str, time: float, kind: str, **fields: Any) -> None:
        self.rows.append((topic, time, kind, fields))

    def image(self, topic: str, time: float, pixels: Any, encoding: str, frame: str = "camera") -> None:
        data = np.ascontiguousarray(pixels)
        self.add(
            topic,
            time,
            "sensor_msgs/msg/Image",
            frame_id=frame,
            height=data.shape[0],
            width=data.shape[1],
            encoding=encoding,
            is_bigendian=0,
            step=data.strides[0],
            data=data.view(np.uint8).ravel(),
        )

    def compressed(self, topic: str, time: float, data: bytes, encoding: str, frame: str = "camera") -> None:
        kind = "sensor_msgs/msg/CompressedImage"
        self.add(topic, time, kind, frame_id=frame, format=encoding, data=np.frombuffer(data, np.uint8))

    def info(
        self, topic: str, camera: Camera, distortion: Iterable[float] = (0,) * 5, frame: str = "camera", time: float = 0
    ) -> None:
        K, d = camera.matrix, np.array(tuple(distortion), dtype=np.float64)
        self.add(
            topic,
            time,
            "sensor_msgs/msg/CameraInfo",
            frame_id=frame,
            height=camera.height,
            width=camera.width,
            distortion_model="rational_polynomial" if len(d) == 8 else "plumb_bob",
            d=d,
            k=K.ravel(),
            r=np.eye(3).ravel(),
            p=np.column_stack([K, np.zeros(3)]).ravel(),
        )

    def write(self, path: Path, compress: bool = False) -> Path:
        """Write the messages to a `.bag`, `.db3` or `.mcap` file."""
        if path.suffix == ".bag":
            return _write_ros1(self, path, compress)
        folder = path.with_suffix(".parts")
        _write_ros2(self, folder, path.suffix == ".mcap", compress)
        (written,) = folder.glob(f"*{path.suffix}")
        written.replace(path)
        shutil.rmtree(folder)
        return path


def depth_png(stored: Any) -> bytes:
    """Return the bytes of compressedDepth: 12 bytes, then a PNG."""
    return bytes(12) + cv2.imencode(".png", stored)[1].tobytes()


def depth_rvl(stored: Any) -> bytes:
    """Return the bytes of compressedDepth: 12 bytes, width and height, then RVL data."""
    height, width = stored.shape
    return bytes(12) + struct.pack("<II", width, height) + compress_rvl(stored)


def compress_rvl(stored: Any) -> bytes:
    """Return 16-bit values in RVL, one after the other as in the paper (Wilson 2017)."""
    nibbles: list[int] = []

    def put(number: int) -> None:
        while number >= 8:
            nibbles.append(8 + number % 8)
            number //= 8
        nibbles.append(number)

    values, last = [int(value) for value in np.ravel(stored)], 0
    while values:
        zeros = next((n for n, value in enumerate(values) if value), len(values))
        put(zeros)
        values = values[zeros:]
        others = next((n for n, value in enumerate(values) if not value), len(values))
        put(others)
        for value in values[:others]:
            put(2 * (value - last) if value >= last else 2 * (last - value) - 1)
            last = value
        values = values[others:]
    nibbles += [0] * (-len(nibbles) % 8)
    words = [int("".join(f"{nibble:x}" for nibble in nibbles[i : i + 8]), 16) for i in range(0, len(nibbles), 8)]
    return struct.pack(f"<{len(words)}I", *words)


def compose(
    depth: Callable[[int], Any],
    colour: Callable[[int], Any] | None,
    camera: Camera,
    times: Iterable[float],
) -> Bag:
    """Return a bag of a ROS driver: depth in millimetres, colour registered to it, one camera."""
    bag = Bag()
    for index, time in enumerate(times):
        bag.image("/camera/depth/image_raw", time, np.rint(depth(index) * 1000).astype("<u2"), "16UC1")
        bag.info("/camera/depth/camera_info", camera, time=time)
        if colour is not None:
            bag.image("/camera/color/image_raw", time, colour(index), "rgb8")
            bag.info("/camera/color/camera_info", camera, time=time)
    return bag


def _message(store: Any, kind: str, time: float, fields: dict[str, Any], ros1: bool) -> Any:
    """Return a message; ROS 1 has CameraInfo in upper case, and a number in headers."""
    fields = dict(fields)
    nanoseconds = round(time * 1e9)
    if "frame_id" in fields:
        stamp = store.types["builtin_interfaces/msg/Time"](nanoseconds // 10**9, nanoseconds % 10**9)
        numbered = (0,) if ros1 else ()
        fields["header"] = store.types["std_msgs/msg/Header"](*numbered, stamp, fields.pop("frame_id"))
    if kind == "sensor_msgs/msg/CameraInfo":
        if ros1:
            fields |= {name.upper(): fields.pop(name) for name in "dkrp"}
        fields["roi"] = store.types["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)
        fields |= {"binning_x": 0, "binning_y": 0}
    return store.types[kind](**fields)


def _write_ros1(bag: Bag, path: Path, compress: bool) -> Path:
    store = get_typestore(Stores.ROS1_NOETIC)
    store.register(get_types_from_msg(_ORBBEC_DEFINITION, ORBBEC_PROFILE))
    writer = Ros1Writer(path)
    if compress:
        writer.set_compression(Ros1Writer.CompressionFormat.LZ4)
    connections: dict[str, Any] = {}
    with writer:
        for topic, time, kind, fields in bag.rows:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            data = store.serialize_ros1(_message(store, kind, time, fields, ros1=True), kind)
            writer.write(connections[topic], round(time * 1e9), data)
    return path


def _write_ros2(bag: Bag, folder: Path, is_mcap: bool, compress: bool) -> None:
    store = get_typestore(Stores.ROS2_HUMBLE)
    writer = Ros2Writer(folder, version=8, storage_plugin=StoragePlugin.MCAP if is_mcap else StoragePlugin.SQLITE3)
    if compress:
        mode = CompressionMode.STORAGE if is_mcap else CompressionMode.MESSAGE
        writer.set_compression(mode, CompressionFormat.ZSTD)
    connections: dict[str, Any] = {}
    with writer:
        for topic, time, kind, fields in bag.rows:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            message = store.serialize_cdr(_message(store, kind, time, fields, ros1=False), kind)
            writer.write(connections[topic], round(time * 1e9), message)
