"""The default backend: a CPU rasteriser of the hand's quadrics, in numba with explicit SIMD."""

from depthtrack.rendering.raster.scorer import RasterScorer

__all__ = ["RasterScorer"]
