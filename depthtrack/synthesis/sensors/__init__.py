"""Depth cameras: from the true surface to what each of them would read. One file a sensor, one protocol for all."""

from typing import Protocol

import numpy as np

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.rendering.rendered_surface import RenderedSurface
from depthtrack.types import Array

SENSOR_NAMES = ("ideal", "kinect1", "kinect2", "realsense")


class Sensor(Protocol):
    """A depth camera with its colour camera, both in one image."""

    @property
    def camera(self) -> Camera:
        """Intrinsics, and what a unit of its stored depth is worth."""
        ...

    @property
    def usual_distance(self) -> float:
        """Where people hold their hands before it, metres."""
        ...

    @property
    def colour_noise(self) -> float:
        """Standard deviation of a pixel's colour, of 255 levels."""
        ...

    def read(self, surface: RenderedSurface, rng: np.random.Generator) -> Array:
        """Depth (h, w) in metres that the sensor reads, 0 where it has no reading. The surface is left as it is."""
        ...


def make_sensor(name: str) -> Sensor:
    """The sensor of that name, with its usual camera. Raises InputError listing the names."""
    if name == "ideal":
        from depthtrack.synthesis.sensors.ideal import Ideal

        return Ideal()
    if name == "kinect1":
        from depthtrack.synthesis.sensors.kinect1 import Kinect1

        return Kinect1()
    if name == "kinect2":
        from depthtrack.synthesis.sensors.kinect2 import Kinect2

        return Kinect2()
    if name == "realsense":
        from depthtrack.synthesis.sensors.realsense import RealSense

        return RealSense()
    raise InputError(f"no sensor '{name}': choose one of {', '.join(SENSOR_NAMES)}")
