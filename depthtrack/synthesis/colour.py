"""Colour conversions (sRGB, CIELAB) and smooth random fields."""

import cv2
import numpy as np

from depthtrack.types import Array

_XYZ_OF_WHITE = np.array([0.950456, 1.0, 1.088754])
"""White of the illuminant D65."""
_RGB = np.array([[3.240479, -1.53715, -0.498535], [-0.969256, 1.875991, 0.041556], [0.055648, -0.204043, 1.057311]])
"""Linear RGB of XYZ (IEC 61966-2-1), for XYZ as multiples of the white."""
_RGB *= _XYZ_OF_WHITE


def linear_from_srgb(srgb: Array) -> Array:
    """Convert sRGB values to linear RGB, both 0 to 1 (IEC 61966-2-1)."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def srgb_from_linear(linear: Array) -> Array:
    """Convert linear RGB to sRGB values, both 0 to 1; values outside are clipped."""
    clipped = np.clip(linear, 0, 1)
    return np.where(clipped <= 0.0031308, clipped * 12.92, 1.055 * clipped ** (1 / 2.4) - 0.055)


def linear_from_lab(lab: Array) -> Array:
    """Convert a CIELAB colour (3,) under D65 to linear RGB (3,), clipped, in single precision.

    The bits are those of OpenCV, which fills large tables at its first conversion.
    """
    lightness, a, b = lab.astype(np.float32)
    fy = (lightness + np.float32(16)) / np.float32(116)
    f = np.array([a / np.float32(500) + fy, fy, fy - b / np.float32(200)])
    linear = (f - np.float32(16 / 116)) / np.float32(7.787)
    xyz = np.where(f <= np.float32(6 / 29), linear, f * f * f)
    r, g, b = (np.float32(row[0]) * xyz[0] + np.float32(row[1]) * xyz[1] + np.float32(row[2]) * xyz[2] for row in _RGB)
    return np.clip(np.array([r, g, b], dtype=np.float64), 0, 1)


def smooth_field(shape: tuple[int, ...], width: float, rng: np.random.Generator) -> Array:
    """Return a smooth normal random field (h, w) with a correlation length of `width` pixels."""
    coarse = rng.standard_normal((int(shape[0] / width) + 2, int(shape[1] / width) + 2))
    return np.asarray(cv2.resize(coarse, (shape[1], shape[0]), interpolation=cv2.INTER_CUBIC), dtype=np.float64)
