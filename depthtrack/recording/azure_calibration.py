"""The calibration that Azure Kinect and Femto attach to a recording.

Lengths are metres. Intrinsics are fractions of the full sensor image, counted from its upper left corner; a mode of the
camera bins and crops that image. Source: Azure Kinect Sensor SDK 1.4, calibration.c and mode_specific_calibration.c.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.distortion import Distortion
from depthtrack.strict_data import parse_json
from depthtrack.types import Array

LARGEST = 1 << 20
"""Bound on the text of the calibration, bytes."""
_DEPTH, _COLOUR = "CALIBRATION_CameraLocationD0", "CALIBRATION_CameraLocationPV0"
_DEPTH_MODES = {
    (320, 288): ((512, 512), (96, 90)),
    (640, 576): ((1024, 1024), (192, 180)),
    (512, 512): ((512, 512), (0, 0)),
    (1024, 1024): ((1024, 1024), (0, 0)),
}
"""Size of the images of a mode: size of the binned sensor image, and offset of the crop, pixels."""
_COLOUR_MODES = {
    (1280, 720): ((1280, 960), (0, 120)),
    (1920, 1080): ((1920, 1440), (0, 180)),
    (2560, 1440): ((2560, 1920), (0, 240)),
    (2048, 1536): ((2048, 1536), (0, 0)),
    (3840, 2160): ((3840, 2880), (0, 360)),
    (4096, 3072): ((4096, 3072), (0, 0)),
}
_MODELS = {
    "CALIBRATION_LensDistortionModelBrownConrady",
    "CALIBRATION_LensDistortionModelRational6KT",
}


@dataclass(frozen=True)
class CalibratedCamera:
    """A camera of the calibration, for images of one size.

    T_camera_reference: (4, 4) from the frame that both cameras share, metres.
    """

    camera: Camera
    distortion: Distortion | None
    T_camera_reference: Array


@dataclass(frozen=True)
class AzureCalibration:
    """The parsed text of a calibration: a description of each camera by its location."""

    cameras: Mapping[str, Mapping[str, Any]]

    @classmethod
    def parse(cls, data: bytes, where: str) -> Self:
        """Return the calibration of an attachment.

        Raises:
            InputError: if it is too long or malformed.
        """
        if len(data) > LARGEST:
            raise InputError(f"{where}: the calibration must have at most {LARGEST:,} bytes, found {len(data):,}")
        try:
            cameras = parse_json(data.rstrip(b"\0").decode())["CalibrationInformation"]["Cameras"]
            return cls({str(camera["Location"]): camera for camera in cameras})
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            raise InputError(f"{where}: the calibration is malformed: {str(error)[:80]}") from error

    def depth(self, size: tuple[int, int], where: str) -> CalibratedCamera:
        """Return the depth camera for images of (width, height). Raises InputError."""
        return self._camera(_DEPTH, _DEPTH_MODES, size, where)

    def colour(self, size: tuple[int, int], where: str) -> CalibratedCamera:
        """Return the colour camera for images of (width, height). Raises InputError."""
        return self._camera(_COLOUR, _COLOUR_MODES, size, where)

    def _camera(self, location: str, modes: Mapping[Any, Any], size: tuple[int, int], where: str) -> CalibratedCamera:
        if size not in modes:
            known = ", ".join(f"{width}x{height}" for width, height in modes)
            raise InputError(
                f"{where}: images must have a size of the camera's modes ({known}), found {size[0]}x{size[1]}"
            )
        try:
            described = self.cameras[location]
            intrinsics = described["Intrinsics"]
            if intrinsics["ModelType"] not in _MODELS:
                raise InputError(f"{where}: the lens model {str(intrinsics['ModelType'])[:60]!r} is not read")
            cx, cy, fx, fy, k1, k2, k3, k4, k5, k6, _, _, p2, p1 = map(float, intrinsics["ModelParameters"][:14])
            rotation = np.array(described["Rt"]["Rotation"], dtype=np.float64).reshape(3, 3)
            translation = np.array(described["Rt"]["Translation"], dtype=np.float64).reshape(3)
            sensor = float(described["SensorWidth"]) / float(described["SensorHeight"])
        except (KeyError, TypeError, ValueError, ZeroDivisionError) as error:
            raise InputError(f"{where}: the calibration of {location} is malformed: {str(error)[:80]}") from error
        if location == _COLOUR and abs(sensor - 16 / 9) < 0.01:
            # An early calibration describes the central 16:9 part of the 4:3 sensor.
            cy, fy = (cy * 2304 + 384) / 3072, fy * 2304 / 3072
        (width, height), (left, top) = modes[size]
        fields = {"width": size[0], "height": size[1], "fx": fx * width, "fy": fy * height}
        centre = {"cx": cx * width - left - 0.5, "cy": cy * height - top - 0.5}
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = rotation, translation
        lens = (k1, k2, p1, p2, k3, k4, k5, k6)
        return CalibratedCamera(Camera.from_fields({**fields, **centre}), Distortion(lens) if any(lens) else None, T)
