"""Kinect v1 and other PrimeSense sensors: structured light.

An infrared projector and an infrared camera triangulate depth.

- Quantisation: disparity steps of 1/8 pixel with f = 580 pixels and a baseline of 75 mm; 0.7 mm at 0.5 m (Khoshelham
  and Elberink, "Accuracy and resolution of Kinect depth data for indoor mapping applications", Sensors 12, 2012).
- Axial noise: sigma = 0.0012 + 0.0019 (z - 0.4)^2, plus 0.0001 / sqrt(z) * theta^2 / (pi/2 - theta)^2 beyond 60
  degrees of incidence. The part that quantisation contributes is subtracted.
- Lateral noise at silhouettes: sigma = 0.8 + 0.035 theta / (pi/2 - theta) pixels. Both noise models: Nguyen, Izadi and
  Lovell, "Modeling Kinect sensor noise for improved 3D reconstruction and tracking", 3DIMPVT 2012.
- Shadow: surfaces occluded from the projector have no reading. The projector is at the right (+x), so shadows lie at
  the left of near objects.
- Dropout at silhouettes and at grazing incidence, since patterns are matched over windows (Mallick, Das and Majumdar,
  "Characterizations of noise in Kinect depth images: a review", IEEE Sensors J. 14, 2014). The rates are our estimate.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from depthtrack.compilation import compiled
from depthtrack.geometry.camera import PRESETS, Camera
from depthtrack.rendering.rendered_surface import RenderedSurface
from depthtrack.synthesis.randomness import coarse_normal_noise, normal_noise, uniform_of, uniform_words
from depthtrack.synthesis.sensors.geometry import (
    JUMP,
    SURELY_FLAT,
    dropout_probability,
    edges,
    incidence_along,
    shadow,
    steep_incidence_along,
)
from depthtrack.types import Array, Array32, Mask

BASELINE = 0.075
"""Distance from the infrared camera to the projector, metres."""
INFRARED_FOCAL = 580.0
"""Focal length of the infrared camera, pixels; the depth image is registered to the colour camera."""
STEPS = 8
"""Quantisation steps of a pixel of disparity."""
_EDGE_DROPOUT = 0.3
_GRAZING = (math.radians(70), math.radians(82))
"""Incidence at which dropout begins, and at which it is complete, radians."""


@dataclass(frozen=True)
class Kinect1:
    """See `Sensor` and the module."""

    camera: Camera = field(default_factory=lambda: PRESETS["kinect1"])
    nearest: float = 0.4
    farthest: float = 5.0
    default_distance: float = 0.5
    colour_noise: float = 3.0

    def read(self, surface: RenderedSurface, rng: np.random.Generator) -> Array:
        """See `Sensor`."""
        shape = surface.depth.shape
        camera, out = self.camera, np.zeros(shape)
        _read(
            surface.depth,
            surface.normal,
            (camera.fx, camera.fy, camera.cx, camera.cy),
            edges(surface.depth),
            shadow(surface.depth, self.camera, BASELINE),
            coarse_normal_noise(rng, (2, *shape)),
            normal_noise(rng, shape),
            uniform_words(rng, shape),
            (self.nearest, self.farthest),
            out,
        )
        return out


@compiled(nogil=True, error_model="numpy")
def axial_noise(z: float, theta: float) -> float:
    """Return the axial standard deviation, metres, at depth z (m) and incidence theta (rad).

    Source: Nguyen et al. 2012, Eq. 1-2.
    """
    sigma = 0.0012 + 0.0019 * (z - 0.4) ** 2
    if theta > math.pi / 3:
        sigma += 0.0001 / math.sqrt(z) * theta**2 / (math.pi / 2 - min(theta, 1.5)) ** 2
    return sigma


@compiled(nogil=True, error_model="numpy")
def lateral_noise(theta: float) -> float:
    """Return the lateral standard deviation of a silhouette, pixels, at incidence theta (rad).

    Source: Nguyen et al. 2012, Eq. 3.
    """
    return 0.8 + 0.035 * theta / (math.pi / 2 - min(theta, 1.5))


@compiled(nogil=True, error_model="numpy")
def _read(
    depth: Array,
    normal: Array,
    lens: tuple[float, float, float, float],
    edge: Mask,
    dark: Mask,
    wander: tuple[NDArray[np.uint8], Array32],
    error: Array32,
    words: NDArray[np.uint32],
    limits: tuple[float, float],
    out: Array,
) -> None:
    height, width = depth.shape
    places, quantiles = wander
    plain, x, y = np.empty(width, np.bool_), np.empty(width), np.empty(height)
    for u in range(width):
        x[u] = (u - lens[2]) / lens[0]
    for v in range(height):
        y[v] = (v - lens[3]) / lens[1]
    for v in range(height):
        _read_plain(depth[v], normal[v], x, y[v], edge[v], dark[v], error[v], limits, plain, out[v])
        for u in range(width):
            if plain[u]:
                continue
            z, row, column = depth[v, u], v, u
            # Lateral noise: near a silhouette, a pixel may read the surface beside it.
            if edge[v, u] or z <= 0.0:
                sigma = lateral_noise(incidence_along(z, normal[v, u], x[u], y[v]) if z > 0.0 else 0.0)
                us = min(max(u + round(sigma * quantiles[places[0, v, u]]), 0), width - 1)
                vs = min(max(v + round(sigma * quantiles[places[1, v, u]]), 0), height - 1)
                if abs(depth[vs, us] - z) > JUMP * z:
                    z, row, column = depth[vs, us], vs, us
            if z <= 0.0 or dark[row, column]:
                continue
            angle = steep_incidence_along(z, normal[row, column], x[column], y[row])
            dropout = dropout_probability(edge[v, u], angle, _EDGE_DROPOUT, _GRAZING[0], _GRAZING[1])
            if uniform_of(words[v, u]) < dropout:
                continue
            z = _quantised(z, axial_noise(z, angle), error[v, u])
            if limits[0] <= z <= limits[1]:
                out[v, u] = z


@compiled(nogil=True, error_model="numpy")
def _read_plain(
    depth: Array,
    normal: Array,
    x: Array,
    y: float,
    edge: Mask,
    dark: Mask,
    error: Array32,
    limits: tuple[float, float],
    plain: Mask,
    out: Array,
) -> None:
    """Read the pixels of a row that neither edge, shadow nor incidence affects.

    They are most, and are marked in `plain`. Without branches, so that the compiler makes vectors of it.

    x, y: (w,) coordinates of the viewing rays of the row at z = 1.
    """
    for u in range(depth.shape[0]):
        along = -(normal[u, 0] * x[u] + normal[u, 1] * y + normal[u, 2])
        flat = (along > 0.0) & (along * along > SURELY_FLAT * (x[u] * x[u] + y * y + 1.0))
        plain[u] = (depth[u] > 0.0) & flat & ~edge[u] & ~dark[u]
    for u in range(depth.shape[0]):
        z = depth[u] if plain[u] else 1.0
        z = _quantised(z, 0.0012 + 0.0019 * (z - 0.4) ** 2, error[u])
        out[u] = z if plain[u] & (limits[0] <= z) & (z <= limits[1]) else 0.0


@compiled(nogil=True, error_model="numpy")
def _quantised(z: float, sigma: float, error: float) -> float:
    """Return the reading of a depth, metres.

    sigma: axial standard deviation, metres.
    error: standard normal.
    """
    # A disparity step equals z^2 / (8 f b) in depth; rounding adds a variance of a twelfth of a step squared.
    scale = STEPS * INFRARED_FOCAL * BASELINE
    inverse = 1.0 / z
    spread = sigma * scale * inverse * inverse
    disparity = scale * inverse + np.sqrt(max(spread * spread - 1.0 / 12.0, 0.0)) * error
    return scale / max(np.rint(disparity), 1.0)
