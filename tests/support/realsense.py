"""A recording by the software device of the RealSense SDK."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from depthtrack.geometry.camera import Camera
from depthtrack.types import Array, Image


def record(
    path: Path,
    depth_camera: Camera,
    colour_camera: Camera,
    T_colour_depth: Array,
    depths: Sequence[Any],
    colours: Sequence[Image],
    unit: float,
) -> None:
    """Record frames of both cameras to a file.

    depths: each (h, w) uint16 in units of `unit` metres.
    """
    import pyrealsense2 as rs

    device: Any = rs.software_device()
    sensors = [device.add_sensor("Depth"), device.add_sensor("Color")]
    sensors[0].add_read_only_option(rs.option.depth_units, unit)
    profiles = [
        sensor.add_video_stream(_stream(rs, kind, number, camera))
        for number, (sensor, kind, camera) in enumerate(
            zip(sensors, (rs.stream.depth, rs.stream.color), (depth_camera, colour_camera), strict=True), start=1
        )
    ]
    extrinsics = rs.extrinsics()
    extrinsics.rotation = T_colour_depth[:3, :3].T.ravel().tolist()  # by columns
    extrinsics.translation = T_colour_depth[:3, 3].tolist()
    profiles[0].register_extrinsics_to(profiles[1], extrinsics)
    recorder: Any = rs.recorder(str(path), device)
    queue = rs.frame_queue(100)
    recorded = recorder.query_sensors()
    for sensor in recorded:
        sensor.open(sensor.get_stream_profiles()[0])
        sensor.start(queue)
    for number, images in enumerate(zip(depths, colours, strict=True)):
        for sensor, profile, image in zip(sensors, profiles, images, strict=True):
            frame = rs.software_video_frame()
            frame.pixels = np.ascontiguousarray(image)
            frame.stride, frame.bpp = image.strides[0], image.strides[1]
            frame.timestamp, frame.domain = number * 1000 / 30, rs.timestamp_domain.hardware_clock
            frame.frame_number, frame.profile = number, profile.as_video_stream_profile()
            if sensor is sensors[0]:
                frame.depth_units = unit
            sensor.on_video_frame(frame)
        time.sleep(0.02)
    time.sleep(0.2)
    for sensor in recorded:
        sensor.stop()
        sensor.close()
    recorder.pause()


def _stream(rs: Any, kind: Any, number: int, camera: Camera) -> Any:
    intrinsics = rs.intrinsics()
    intrinsics.width, intrinsics.height = camera.width, camera.height
    intrinsics.fx, intrinsics.fy, intrinsics.ppx, intrinsics.ppy = camera.fx, camera.fy, camera.cx, camera.cy
    intrinsics.model, intrinsics.coeffs = rs.distortion.brown_conrady, [0.0] * 5
    stream = rs.video_stream()
    stream.type, stream.index, stream.uid = kind, 0, number
    stream.width, stream.height, stream.fps = camera.width, camera.height, 30
    stream.bpp, stream.fmt = (2, rs.format.z16) if kind == rs.stream.depth else (3, rs.format.rgb8)
    stream.intrinsics = intrinsics
    return stream
