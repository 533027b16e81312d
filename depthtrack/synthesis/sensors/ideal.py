"""A perfect depth camera: the exact depth at every pixel centre."""

from dataclasses import dataclass, field, replace

import numpy as np

from depthtrack.geometry.camera import PRESETS, Camera
from depthtrack.rendering.rendered_surface import RenderedSurface
from depthtrack.synthesis.randomness import normal_noise
from depthtrack.types import Array


@dataclass(frozen=True)
class Ideal:
    """See `Sensor`: Kinect v1's intrinsics with a depth scale of 0.1 mm, up to 6.5 m."""

    camera: Camera = field(default_factory=lambda: replace(PRESETS["kinect1"], depth_scale=0.0001))
    nearest: float = 0.0
    default_distance: float = 0.5
    colour_noise: float = 0.0

    def read(self, surface: RenderedSurface, rng: np.random.Generator) -> Array:
        """See `Sensor`."""
        return surface.depth.copy()


def with_gaussian_noise(depth: Array, deviation: float, rng: np.random.Generator) -> Array:
    """Add independent normal noise to a depth map.

    depth (h, w): metres; pixels without a reading stay 0.
    deviation: standard deviation, metres.
    Source: Oikonomidis et al. 2011, Fig. 2c.
    """
    noisy = depth + deviation * normal_noise(rng, depth.shape)
    return np.where(depth > 0, np.maximum(noisy, 0), 0)
