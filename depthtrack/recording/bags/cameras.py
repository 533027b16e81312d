"""Cameras of a bag: intrinsics, distortion, depth unit, transform from depth to colour.

Sources: sensor_msgs/CameraInfo; the files of librealsense 2.59 (ros2_writer.cpp) and before (ros_file_format.h); Orbbec
SDK 2 (RosbagWriter.cpp).
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.distortion import Distortion
from depthtrack.recording.bags.messages import Messages
from depthtrack.recording.bags.transforms import realsense_transform, static_transform
from depthtrack.types import Array

CAMERA_INFO, ORBBEC_PROFILE = "sensor_msgs/msg/CameraInfo", re.compile(r"^/cam/streamProfileType_(\d+)$")
_ORBBEC_FRAME = re.compile(r"^/cam/sensor_\d+/frameType_(\d+)$")
_DEPTH_UNIT = re.compile(r"option/depth[_ ]units/value$", re.IGNORECASE)
_REALSENSE_STREAM = re.compile(r"^/device_\d+/sensor_\d+/[A-Za-z]+_\d+")
MILLIMETRE = 0.001
FLOAT_STEP = 0.0002
"""Step, metres, in which depth given as floats is stored by a conversion: up to 13 m in 16 bits."""


@dataclass(frozen=True)
class BagCamera:
    """A camera of a bag.

    frame: name of its coordinate frame.
    distortion: None if there is none.
    """

    camera: Camera
    distortion: Distortion | None
    frame: str


def camera_of(messages: Messages, topic: str, size: tuple[int, int]) -> BagCamera | None:
    """Return the camera of the images of a topic; None if the bag does not describe it.

    size: (width, height) of the images.

    Raises:
        InputError: if the camera is described, but unusable.
    """
    if (match := _ORBBEC_FRAME.match(topic)) is not None:
        return _orbbec_camera(messages, f"/cam/streamProfileType_{match[1]}", size)
    infos = [name for name, each in messages.topics.items() if each.kind == CAMERA_INFO]
    if not infos:
        return None
    name = max(infos, key=lambda info: (_common_parts(info, topic), info))
    if _common_parts(name, topic) == 0 and len(infos) > 1:
        return None
    info = messages.first(name)
    return _from_info(info, size, is_rectified="rect" in topic.lower(), where=f"{messages.storage.path}: {name}")


def depth_unit(messages: Messages, topic: str) -> float:
    """Return the unit of 16-bit depth, metres: the sensor's option, or a millimetre."""
    options = [name for name in messages.topics if _DEPTH_UNIT.search(name)]
    if not options:
        return MILLIMETRE
    value = messages.first(max(options, key=lambda name: _common_parts(name, topic))).data
    try:
        unit = float(value)
    except ValueError:
        unit = 0.0
    # An SDK that writes 0 states no unit.
    return float(np.float64(f"{unit:.6g}")) if 1e-6 <= unit <= 0.1 else MILLIMETRE


def transform_between(
    messages: Messages, depth_topic: str, depth: BagCamera, colour_topic: str, colour: BagCamera
) -> Array | None:
    """Return the transform (4, 4) from depth camera to colour camera, metres; None if unknown."""
    if depth.frame and depth.frame == colour.frame:
        return np.eye(4)
    if (match := _ORBBEC_FRAME.match(depth_topic)) is not None:
        return _orbbec_transform(messages, f"/cam/streamProfileType_{match[1]}")
    streams = [_REALSENSE_STREAM.match(topic) for topic in (depth_topic, colour_topic)]
    if all(streams):
        return realsense_transform(messages, *(match[0] for match in streams if match is not None))
    return static_transform(messages, depth.frame, colour.frame)


def _common_parts(first: str, second: str) -> int:
    """Return the number of leading parts that two topics share."""
    count = 0
    for a, b in zip(first.strip("/").split("/"), second.strip("/").split("/"), strict=False):
        if a != b:
            break
        count += 1
    return count


def _from_info(info: Any, size: tuple[int, int], is_rectified: bool, where: str) -> BagCamera:
    # ROS 1 writes these names in upper case.
    k, p, d = (np.asarray(getattr(info, name, getattr(info, name.upper(), ()))).ravel() for name in ("k", "p", "d"))
    width, height = size
    if (int(info.width), int(info.height)) != size:
        raise InputError(f"{where} describes images of {info.width}x{info.height}, found {width}x{height}")
    if is_rectified and len(p) == 12 and p[0] > 0:
        numbers, distortion = (p[0], p[5], p[2], p[6]), None
    else:
        numbers = (k[0], k[4], k[2], k[5])
        distortion = _named(where, Distortion.of, str(info.distortion_model), [float(value) for value in d])
    return BagCamera(_camera(size, numbers, where), distortion, str(info.header.frame_id).lstrip("/"))


def _named(where: str, make: Any, *arguments: Any) -> Any:
    """Return `make(*arguments)`; its error names `where`."""
    try:
        return make(*arguments)
    except InputError as error:
        raise InputError(f"{where}: {error}") from error


def _camera(size: tuple[int, int], numbers: Iterable[Any], where: str) -> Camera:
    fx, fy, cx, cy = (float(number) for number in numbers)
    fields = {"width": size[0], "height": size[1], "fx": fx, "fy": fy, "cx": cx, "cy": cy}
    camera: Camera = _named(where, Camera.from_fields, fields)
    return camera


def _orbbec_camera(messages: Messages, profile: str, size: tuple[int, int]) -> BagCamera | None:
    stream = _orbbec_profile(messages, profile)
    if stream is None:
        return None
    k1, k2, k3, k4, k5, k6, p1, p2 = (float(value) for value in stream.cameraDistortion)
    coefficients = (k1, k2, p1, p2, k3, k4, k5, k6)
    where = f"{messages.storage.path}: {profile}"
    distortion = _named(where, Distortion, coefficients) if any(coefficients) else None
    return BagCamera(_camera(size, list(stream.cameraIntrinsic)[:4], where), distortion, profile)


def _orbbec_transform(messages: Messages, profile: str) -> Array | None:
    stream = _orbbec_profile(messages, profile)
    if stream is None:
        return None
    T = np.eye(4)
    T[:3, :3] = np.asarray(stream.rotationMatrix, dtype=np.float64).reshape(3, 3)
    T[:3, 3] = np.asarray(stream.translationMatrix, dtype=np.float64) / 1000
    return T if np.any(T[:3, :3]) else None


def _orbbec_profile(messages: Messages, profile: str) -> Any:
    try:
        return messages.first(profile) if profile in messages.topics else None
    except DamagedFrameError:
        return None
