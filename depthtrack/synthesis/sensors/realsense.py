"""Intel RealSense, stereo cameras of the D400 family: two infrared imagers match what they see, window by window.

- Depth error z^2 s / (f b) with s = 0.08 pixel of disparity noise and the baseline b = 50 mm (Grunnet-Jepsen, Sweetser
  and Woodfill, "Best-known-methods for tuning Intel RealSense D400 depth cameras", Intel 2018; measured by Ahn et al.,
  "Analysis and noise modeling of the Intel RealSense D435 for mobile robots", Ubiquitous Robots 2019). Windows that
  overlap share their error, so it is smooth over a few pixels: surfaces look wavy rather than grainy.
- Disparity is searched up to 126 pixels, which sets the nearest depth, and given in steps of 1/32 pixel (same source;
  Grunnet-Jepsen et al., "Subpixel linearity improvement for Intel RealSense", 2019).
- A window across a silhouette takes the nearer surface's disparity, so that objects grow fatter by about a window's
  radius, unevenly ("foreground fattening"; Scharstein and Szeliski, "A taxonomy and evaluation of dense two-frame
  stereo correspondence algorithms", IJCV 47, 2002). Radius and share are our estimates.
- What the right imager does not see has no depth: a strip along the left of whatever stands in front.

The camera has the nominal intrinsics of an SR300, whose coded light triangulates over about the same baseline.
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
"""Metres between the imagers."""
SUBPIXEL = 0.08
"""Standard deviation of a disparity, pixels."""
_STEPS = 32
_LARGEST_DISPARITY = 126
_WINDOW = 1.5
"""Standard deviation, pixels, of the Gaussian that stands for the matching window."""
_FATTENING = 2
_EDGE_DROPOUT = 0.3
_GRAZING = (math.radians(72), math.radians(85))


@dataclass(frozen=True)
class RealSense:
    """See `Sensor` and the module."""

    camera: Camera = field(default_factory=lambda: PRESETS["realsense"])
    farthest: float = 6.0
    usual_distance: float = 0.5
    colour_noise: float = 2.5

    @property
    def nearest(self) -> float:
        """Metres: where the disparity reaches the end of its search range."""
        return self.camera.fx * BASELINE / _LARGEST_DISPARITY

    def read(self, surface: RenderedSurface, rng: np.random.Generator) -> Array:
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
    """(h, w) normal noise of unit variance, alike over a matching window."""
    white = normal_noise(rng, shape)
    size = 2 * math.ceil(3 * _WINDOW) + 1
    kernel = cv2.getGaussianKernel(size, _WINDOW)
    # Averaging shrinks the variance by the sum of the squared weights, in either direction.
    return np.asarray(cv2.sepFilter2D(white, cv2.CV_32F, kernel, kernel / np.sum(kernel**2)), dtype=np.float32)


def _fattened(depth: Array, where: Mask) -> tuple[Array, Mask]:
    """Depth whose nearer surfaces have grown over farther ones, and the pixels that they took."""
    far = np.where(depth > 0, depth, np.inf)
    window = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * _FATTENING + 1, 2 * _FATTENING + 1))
    nearest = cv2.erode(far, window)
    grown = where & (nearest < far * (1 - JUMP))
    return np.where(grown, nearest, depth), grown
