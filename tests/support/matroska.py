"""Matroska files as the recorders of Azure Kinect and Femto write them, byte by byte.

Source: Microsoft, "Use Azure Kinect Sensor SDK to record file format"; RFC 9559 (Matroska).
"""

import json
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from depthtrack.geometry.camera import Camera
from depthtrack.types import Array, Image

_MICROSECOND = 1000
"""Nanoseconds of a unit of time in the files of k4arecorder."""


def element(number: int, *parts: bytes) -> bytes:
    """Return an EBML element."""
    content = b"".join(parts)
    return (
        number.to_bytes((number.bit_length() + 7) // 8, "big") + (len(content) | 1 << 56).to_bytes(8, "big") + content
    )


def unsigned(number: int, value: int) -> bytes:
    return element(number, value.to_bytes(8, "big"))


def text(number: int, value: str) -> bytes:
    return element(number, value.encode())


def track(number: int, name: str, width: int, height: int, fourcc: bytes, bits: int) -> bytes:
    """Return a video track; its codec is named by a BITMAPINFOHEADER."""
    private = struct.pack("<IiiHH4sIiiII", 40, width, height, 1, bits, fourcc, width * height * bits // 8, 0, 0, 0, 0)
    return element(
        0xAE,
        unsigned(0xD7, number),
        unsigned(0x73C5, number),
        unsigned(0x83, 1),
        text(0x536E, name),
        text(0x86, "V_MS/VFW/FOURCC"),
        element(0x63A2, private),
        element(0xE0, unsigned(0xB0, width), unsigned(0xBA, height)),
    )


def calibration(depth: Camera, colour: Camera, T_colour_depth: Array, coefficients: Sequence[float] = ()) -> str:
    """Return the calibration of a 640x576 depth camera and a 1280x720 colour camera.

    coefficients: distortion of the colour camera, k1 k2 p1 p2 k3 k4 k5 k6.
    """
    k1, k2, p1, p2, k3, k4, k5, k6 = (*coefficients, *(0.0,) * (8 - len(coefficients)))
    cameras = []
    for location, camera, size, offset, T, lens in (
        ("D0", depth, (1024, 1024), (192, 180), np.eye(4), (0.0,) * 10),
        ("PV0", colour, (1280, 960), (0, 120), T_colour_depth, (k1, k2, k3, k4, k5, k6, 0.0, 0.0, p2, p1)),
    ):
        across = (camera.cx + 0.5 + offset[0]) / size[0], camera.fx / size[0]
        down = (camera.cy + 0.5 + offset[1]) / size[1], camera.fy / size[1]
        cameras.append(
            {
                "Intrinsics": {
                    "ModelParameterCount": 14,
                    "ModelParameters": [across[0], down[0], across[1], down[1], *lens],
                    "ModelType": "CALIBRATION_LensDistortionModelBrownConrady",
                },
                "Location": f"CALIBRATION_CameraLocation{location}",
                "MetricRadius": 1.7,
                "Rt": {"Rotation": T[:3, :3].ravel().tolist(), "Translation": T[:3, 3].tolist()},
                "SensorHeight": 1024 if location == "D0" else 3072,
                "SensorWidth": 1024 if location == "D0" else 4096,
            }
        )
    return json.dumps({"CalibrationInformation": {"Cameras": cameras}})


def write_azure_kinect(
    path: Path,
    depths: Sequence[Any],
    colours: Sequence[Image],
    described: str | None,
    times: Sequence[float],
    fourcc: bytes = b"b16g",
) -> Path:
    """Write depth (h, w) uint16 in millimetres, and colour as JPEG.

    described: text of the calibration, None for none.
    times: seconds.
    """
    height, width = depths[0].shape
    tracks = [track(1, "DEPTH", width, height, fourcc, 16)]
    if colours:
        tracks.insert(0, track(2, "COLOR", colours[0].shape[1], colours[0].shape[0], b"MJPG", 24))
    attachments = (
        []
        if described is None
        else [
            element(
                0x1941A469,
                element(
                    0x61A7,
                    text(0x466E, "calibration.json"),
                    text(0x4660, "application/octet-stream"),
                    unsigned(0x46AE, 77),
                    element(0x465C, described.encode() + b"\0"),
                ),
            )
        ]
    )
    clusters = []
    for index, time in enumerate(times):
        frames = [(1, np.asarray(depths[index]).astype(">u2").tobytes())]
        if colours:
            quality = (cv2.IMWRITE_JPEG_QUALITY, 98)
            frames.append((2, cv2.imencode(".jpg", colours[index][..., ::-1], quality)[1].tobytes()))
        blocks = [element(0xA3, bytes([0x80 | number, 0, 0, 0x80]), data) for number, data in frames]
        clusters.append(element(0x1F43B675, unsigned(0xE7, round(time * 1e9) // _MICROSECOND), *blocks))
    head = element(0x1A45DFA3, text(0x4282, "matroska"), unsigned(0x4287, 4), unsigned(0x4285, 2))
    info = element(0x1549A966, unsigned(0x2AD7B1, _MICROSECOND), text(0x4D80, "libk4arecord"), text(0x5741, "k4a"))
    body = [info, element(0x1654AE6B, *tracks), *attachments, *clusters]
    path.write_bytes(head + element(0x18538067, *body))
    return path
