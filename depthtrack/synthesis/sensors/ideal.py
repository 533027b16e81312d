"""A perfect depth camera: the true depth at every pixel centre."""

from dataclasses import dataclass, field, replace

import numpy as np

from depthtrack.geometry.camera import PRESETS, Camera
from depthtrack.rendering.rendered_surface import RenderedSurface
from depthtrack.synthesis.randomness import normal_noise
from depthtrack.types import Array


@dataclass(frozen=True)
class Ideal:
    """See `Sensor`. Kinect v1's image, stored in steps of 0.1 mm (up to 6.5 m), so that rounding does not matter."""

    camera: Camera = field(default_factory=lambda: replace(PRESETS["kinect1"], depth_scale=0.0001))
    usual_distance: float = 0.5
    colour_noise: float = 0.0

    def read(self, surface: RenderedSurface, rng: np.random.Generator) -> Array:
        return surface.depth.copy()


def with_gaussian_noise(depth: Array, deviation: float, rng: np.random.Generator) -> Array:
    """Depth (h, w) with independent normal errors of `deviation` metres (Oikonomidis et al. 2011, Fig. 2c)."""
    noisy = depth + deviation * normal_noise(rng, depth.shape)
    return np.where(depth > 0, np.maximum(noisy, 0), 0)
