"""Colour conversions (sRGB, CIELAB) and smooth random fields."""

import cv2
import numpy as np

from depthtrack.types import Array


def linear_from_srgb(srgb: Array) -> Array:
    """Convert sRGB values to linear RGB, both 0 to 1 (IEC 61966-2-1)."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def srgb_from_linear(linear: Array) -> Array:
    """Convert linear RGB to sRGB values, both 0 to 1; values outside are clipped."""
    clipped = np.clip(linear, 0, 1)
    return np.where(clipped <= 0.0031308, clipped * 12.92, 1.055 * clipped ** (1 / 2.4) - 0.055)


def linear_from_lab(lab: Array) -> Array:
    """Convert a CIELAB colour (3,) under D65 to linear RGB (3,)."""
    return np.asarray(cv2.cvtColor(lab.astype(np.float32)[None, None], cv2.COLOR_Lab2LRGB)[0, 0], dtype=np.float64)


def smooth_field(shape: tuple[int, ...], width: float, rng: np.random.Generator) -> Array:
    """Return a smooth normal random field (h, w) with a correlation length of `width` pixels."""
    coarse = rng.standard_normal((int(shape[0] / width) + 2, int(shape[1] / width) + 2))
    return np.asarray(cv2.resize(coarse, (shape[1], shape[0]), interpolation=cv2.INTER_CUBIC), dtype=np.float64)
