"""Kinect v1 and its PrimeSense kin: structured light, triangulated between an infrared projector and a camera.

- Disparity comes in steps of 1/8 pixel over f = 580 pixels and a baseline of 75 mm (Khoshelham and Elberink, "Accuracy
  and resolution of Kinect depth data for indoor mapping applications", Sensors 12, 2012): 0.7 mm steps at 0.5 m.
- Noise along the axis: sigma = 0.0012 + 0.0019 (z - 0.4)^2, and beyond 60 degrees of incidence
  0.0001 / sqrt(z) * theta^2 / (pi/2 - theta)^2 more; silhouettes waver by sigma = 0.8 + 0.035 theta / (pi/2 - theta)
  pixels (Nguyen, Izadi and Lovell, "Modeling Kinect sensor noise for improved 3D reconstruction and tracking",
  3DIMPVT 2012). What the steps themselves contribute to the noise is taken off.
- What the projector does not reach has no reading: a shadow to the left of whatever stands in front. The projector is
  to the right of the camera, as the sensor looks out.
- Patterns are matched over windows, so readings drop out at silhouettes and where the pattern is stretched by a grazing
  surface (Mallick, Das and Majumdar, "Characterizations of noise in Kinect depth images: a review", IEEE Sensors J.
  14, 2014). How often they do is our estimate.
"""

import math
from dataclasses import dataclass, field

import numba
import numpy as np

from depthtrack.geometry.camera import PRESETS, Camera
from depthtrack.rendering.rendered_surface import RenderedSurface
from depthtrack.synthesis.randomness import coarse_normal_noise, normal_noise
from depthtrack.synthesis.sensors.geometry import JUMP, edges, incidence, shadow
from depthtrack.types import Array, Array32, Mask

BASELINE = 0.075
"""Metres from the infrared camera to the projector."""
INFRARED_FOCAL = 580.0
"""Pixels; the depth image itself is registered to the colour camera."""
STEPS = 8
"""Disparity steps a pixel."""
_EDGE_DROPOUT = 0.3
_GRAZING = (math.radians(70), math.radians(82))
"""Incidence at which readings begin to fail, and at which none is left."""


@dataclass(frozen=True)
class Kinect1:
    """See `Sensor` and the module."""

    camera: Camera = field(default_factory=lambda: PRESETS["kinect1"])
    nearest: float = 0.4
    farthest: float = 5.0
    usual_distance: float = 0.5
    colour_noise: float = 3.0

    def read(self, surface: RenderedSurface, rng: np.random.Generator) -> Array:
        shape = surface.depth.shape
        theta = incidence(surface, self.camera)
        out = np.zeros(shape)
        _read(
            surface.depth,
            theta,
            edges(surface.depth),
            shadow(surface.depth, self.camera, BASELINE),
            coarse_normal_noise(rng, (2, *shape)),
            normal_noise(rng, shape),
            rng.random(shape, dtype=np.float32),
            (self.nearest, self.farthest),
            out,
        )
        return out


@numba.njit(cache=True, nogil=True)
def axial_noise(z: float, theta: float) -> float:
    """Standard deviation in metres at depth z (m) and incidence theta (rad): Nguyen et al. 2012, Eq. 1-2."""
    sigma = 0.0012 + 0.0019 * (z - 0.4) ** 2
    if theta > math.pi / 3:
        sigma += 0.0001 / math.sqrt(z) * theta**2 / (math.pi / 2 - min(theta, 1.5)) ** 2
    return sigma


@numba.njit(cache=True, nogil=True)
def lateral_noise(theta: float) -> float:
    """Standard deviation in pixels of a silhouette: Nguyen et al. 2012, Eq. 3."""
    return 0.8 + 0.035 * theta / (math.pi / 2 - min(theta, 1.5))


@numba.njit(cache=True, nogil=True)
def _read(
    depth: Array,
    theta: Array,
    edge: Mask,
    dark: Mask,
    wander: Array32,
    error: Array32,
    uniform: Array32,
    reach: tuple[float, float],
    out: Array,
) -> None:
    height, width = depth.shape
    for v in range(height):
        for u in range(width):
            z, angle, blind = depth[v, u], theta[v, u], dark[v, u]
            # Silhouettes waver: near one, a pixel may see what is beside it. Within a surface nothing moves.
            if edge[v, u] or z <= 0.0:
                sigma = lateral_noise(angle if z > 0.0 else 0.0)
                us = min(max(u + round(sigma * wander[0, v, u]), 0), width - 1)
                vs = min(max(v + round(sigma * wander[1, v, u]), 0), height - 1)
                if abs(depth[vs, us] - z) > JUMP * z:
                    z, angle, blind = depth[vs, us], theta[vs, us], dark[vs, us]
            if z <= 0.0 or blind or uniform[v, u] < _dropout(edge[v, u], angle):
                continue
            # One disparity step is worth z^2 / (8 f b); rounding to it adds a twelfth of a step squared.
            scale = STEPS * INFRARED_FOCAL * BASELINE
            sigma = axial_noise(z, angle) * scale / (z * z)
            disparity = scale / z + math.sqrt(max(sigma * sigma - 1.0 / 12.0, 0.0)) * error[v, u]
            z = scale / max(round(disparity), 1)
            if reach[0] <= z <= reach[1]:
                out[v, u] = z


@numba.njit(cache=True, nogil=True)
def _dropout(edge: bool, theta: float) -> float:
    """Probability that a reading fails."""
    grazing = min(max((theta - _GRAZING[0]) / (_GRAZING[1] - _GRAZING[0]), 0.0), 1.0)
    return max(grazing, _EDGE_DROPOUT if edge else 0.0)
