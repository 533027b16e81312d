"""Definitions that compiled and numpy residuals share; each takes scalars or arrays."""

import numpy as np

from depthtrack.simd.vectors import kernel_part
from depthtrack.types import Array


def geman_mcclure(square: Array, kernel_scale: float) -> Array:
    """Return the Geman-McClure weight of residuals: 1 at zero, 1/4 at the kernel scale.

    square: squared distances, m^2.
    kernel_scale: m, positive.

    Source: Geman and McClure, "Statistical methods for tomographic image reconstruction", 1987.
    """
    share = 1.0 / (1.0 + square / (kernel_scale * kernel_scale))
    return share * share


def symmetric_direction(nx: Array, ny: Array, nz: Array, mx: Array, my: Array, mz: Array) -> tuple[Array, Array, Array]:
    """Return the unit mean of two unit normals: the direction of a symmetric residual.

    The symmetric point-to-plane residual vanishes on curved surfaces too
    (Rusinkiewicz, "A symmetric objective function for ICP", 2019).
    """
    x, y, z = nx + mx, ny + my, nz + mz
    scale = 1.0 / np.sqrt(np.maximum(x * x + y * y + z * z, 1e-12))
    return x * scale, y * scale, z * scale


compiled_geman_mcclure = kernel_part(geman_mcclure)
compiled_symmetric_direction = kernel_part(symmetric_direction)
