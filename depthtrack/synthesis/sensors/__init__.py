"""Sensor models of depth cameras: readings with realistic errors from the exact surface."""

from typing import Protocol

import numpy as np

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.rendering.rendered_surface import RenderedSurface
from depthtrack.types import Array

SENSOR_NAMES = ("ideal", "kinect1", "kinect2", "realsense")


class Sensor(Protocol):
    """A depth camera whose depth is registered to its colour image."""

    @property
    def camera(self) -> Camera:
        """Return the intrinsics and the depth scale."""
        ...

    @property
    def nearest(self) -> float:
        """Return the smallest depth that is read, metres."""
        ...

    @property
    def default_distance(self) -> float:
        """Return the default distance of the hand, metres."""
        ...

    @property
    def colour_noise(self) -> float:
        """Return the standard deviation of a pixel's colour, in levels of 255."""
        ...

    def read(self, surface: RenderedSurface, rng: np.random.Generator) -> Array:
        """Return the depth reading of a rendered surface, which is not modified.

        Result (h, w): metres; 0 without a reading.
        """
        ...


def make_sensor(name: str) -> Sensor:
    """Return the sensor of that name with its default camera.

    Raises: InputError if there is none.
    """
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
