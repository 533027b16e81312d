"""Intel RealSense D400 family: stereo matching of two infrared imagers over windows.

- Depth error z^2 s / (f b), with disparity noise s = 0.08 pixel and baseline b = 50 mm (Grunnet-Jepsen, Sweetser and
  Woodfill, "Best-known-methods for tuning Intel RealSense D400 depth cameras", Intel 2018). Ahn et al. measured it
  ("Analysis and noise modeling of the Intel RealSense D435 for mobile robots", Ubiquitous Robots 2019).
- Overlapping windows have correlated errors, so the noise is smooth over a few pixels.
- The search range of 126 pixels of disparity sets the nearest depth. Disparity has steps of 1/32 pixel (same source,
  and Grunnet-Jepsen et al., "Subpixel linearity improvement for Intel RealSense", 2019).
- Foreground fattening: a window across a silhouette takes the nearer surface's disparity. Near objects grow by about a
  window's radius (Scharstein and Szeliski, "A taxonomy and evaluation of dense two-frame stereo correspondence
  algorithms", IJCV 47, 2002). Radius and share are our estimates.
- Shadow: surfaces occluded from the right imager have no reading, at the left of near objects.

The camera has the nominal intrinsics of an SR300, whose coded light triangulates over a similar baseline.
"""

import math
from dataclasses import dataclass, field

import cv2
import numpy as np

from depthtrack.geometry.camera import PRESETS, Camera
from depthtrack.rendering.rendered_surface import RenderedSurface
from depthtrack.synthesis.randomness import normal_noise
from depthtrack.synthesis.sensors.geometry import JUMP, edges, incidence, shadow
from depthtrack.types import Array, Array32, Mask

BASELINE = 0.050
"""Distance of the imagers, metres."""
SUBPIXEL = 0.08
"""Standard deviation of the disparity, pixels."""
_STEPS = 32
_LARGEST_DISPARITY = 126
_WINDOW = 1.5
"""Standard deviation of the Gaussian that models the matching window, pixels."""
_FATTENING = 2
_EDGE_DROPOUT = 0.3
_GRAZING = (math.radians(72), math.radians(85))


@dataclass(frozen=True)
class RealSense:
    """See `Sensor` and the module."""

    camera: Camera = field(default_factory=lambda: PRESETS["realsense"])
    farthest: float = 6.0
    default_distance: float = 0.5
    colour_noise: float = 2.5

    @property
    def nearest(self) -> float:
        """Return the smallest depth, metres: the end of the disparity search range."""
        return self.camera.fx * BASELINE / _LARGEST_DISPARITY

    def read(self, surface: RenderedSurface, rng: np.random.Generator) -> Array:
        """See `Sensor`."""
        shape = surface.depth.shape
        disparity_noise, unevenness = SUBPIXEL * _smooth_noise(shape, rng), _smooth_noise(shape, rng)
        chance = rng.random(shape, dtype=np.float32)
        depth, grown = _fattened(surface.depth, unevenness > 0.2)

        grazing = np.clip((incidence(surface, self.camera) - _GRAZING[0]) / (_GRAZING[1] - _GRAZING[0]), 0, 1)
        dropout = np.maximum(np.where(grown, 0, grazing), _EDGE_DROPOUT * edges(depth))
        failed = (chance < dropout) | shadow(depth, self.camera, BASELINE)

        focal_baseline = self.camera.fx * BASELINE
        disparity = focal_baseline / np.maximum(depth, 1e-6) + disparity_noise
        read = focal_baseline / np.maximum(np.round(disparity * _STEPS) / _STEPS, 1 / _STEPS)
        return np.where((depth > 0) & ~failed & (read >= self.nearest) & (read <= self.farthest), read, 0)


def _smooth_noise(shape: tuple[int, ...], rng: np.random.Generator) -> Array32:
    """Return normal noise (h, w) of unit variance, correlated over a matching window."""
    white = normal_noise(rng, shape)
    size = 2 * math.ceil(3 * _WINDOW) + 1
    kernel = cv2.getGaussianKernel(size, _WINDOW)
    # The filter reduces the variance by the sum of the squared weights, in both directions.
    return np.asarray(cv2.sepFilter2D(white, cv2.CV_32F, kernel, kernel / np.sum(kernel**2)), dtype=np.float32)


def _fattened(depth: Array, where: Mask) -> tuple[Array, Mask]:
    """Return the depth (h, w) after foreground fattening, and the changed pixels (h, w)."""
    far = np.where(depth > 0, depth, np.inf)
    window = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * _FATTENING + 1, 2 * _FATTENING + 1))
    nearest = cv2.erode(far, window)
    grown = where & (nearest < far * (1 - JUMP))
    return np.where(grown, nearest, depth), grown
