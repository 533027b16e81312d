"""Kinect v2: time of flight.

- Axial noise, mm: sigma = 1.5 - 0.5 z + 0.3 z^2 + 0.1 z^(3/2) theta^2 / (pi/2 - theta)^2, with z in metres and the
  incidence theta in radians (Fankhauser et al., "Kinect v2 for mobile robot navigation: evaluation and modeling", ICAR
  2015). Static, flat parts of a real recording have 2.3 mm at 2.7 m; the formula gives 2.4.
- Flying pixels: a pixel across a silhouette mixes the light of both surfaces and reads a depth in between (Sarbolandi,
  Lefloch and Kolb, "Kinect range sensing: structured-light versus time-of-flight Kinect", CVIU 139, 2015). The driver
  rejects many; half of them is our estimate.
- Dropout at grazing incidence, from which little light returns. The range is 0.5 to 4.5 m (Pagliari and Pinto,
  "Calibration of Kinect for Xbox One and comparison between the two generations of Microsoft sensors", Sensors 15,
  2015).
"""

import math
from dataclasses import dataclass, field

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.geometry.camera import PRESETS, Camera
from depthtrack.rendering.rendered_surface import RenderedSurface
from depthtrack.synthesis.randomness import normal_noise
from depthtrack.synthesis.sensors.geometry import JUMP, dropout_probability, edges, incidence
from depthtrack.types import Array, Array32, Mask

_EDGE_DROPOUT = 0.5
_GRAZING = (math.radians(75), math.radians(86))
"""Incidence at which dropout begins, and at which it is complete, radians."""


@dataclass(frozen=True)
class Kinect2:
    """See `Sensor` and the module."""

    camera: Camera = field(default_factory=lambda: PRESETS["kinect2"])
    nearest: float = 0.5
    farthest: float = 4.5
    default_distance: float = 0.65
    colour_noise: float = 2.5

    def read(self, surface: RenderedSurface, rng: np.random.Generator) -> Array:
        """See `Sensor`."""
        shape = surface.depth.shape
        out = np.zeros(shape)
        _read(
            surface.depth,
            incidence(surface, self.camera),
            edges(surface.depth),
            normal_noise(rng, shape),
            rng.random((2, *shape), dtype=np.float32),
            (self.nearest, self.farthest),
            out,
        )
        return out


@compiled(nogil=True)
def axial_noise(z: float, theta: float) -> float:
    """Return the axial standard deviation, metres, at depth z (m) and incidence theta (rad).

    Source: Fankhauser et al. 2015.
    """
    grazing = 0.1 * z**1.5 * theta**2 / (math.pi / 2 - min(theta, 1.5)) ** 2
    return (1.5 - 0.5 * z + 0.3 * z * z + grazing) * 1e-3


@compiled(nogil=True)
def _read(
    depth: Array,
    theta: Array,
    edge: Mask,
    error: Array32,
    uniform: Array32,
    limits: tuple[float, float],
    out: Array,
) -> None:
    height, width = depth.shape
    for v in range(height):
        for u in range(width):
            z = depth[v, u]
            if z <= 0.0 or uniform[0, v, u] < dropout_probability(
                edge[v, u], theta[v, u], _EDGE_DROPOUT, _GRAZING[0], _GRAZING[1]
            ):
                continue
            z += axial_noise(z, theta[v, u]) * error[v, u]
            if edge[v, u]:
                z = _mixed(depth, v, u, z, uniform[1, v, u])
            if limits[0] <= z <= limits[1]:
                out[v, u] = z


@compiled(nogil=True)
def _mixed(depth: Array, v: int, u: int, z: float, share: float) -> float:
    """Return a flying pixel's depth: the mean of two surfaces, weighted by area and 1 / z^2."""
    height, width = depth.shape
    for dv, du in ((0, -1), (0, 1), (-1, 0), (1, 0)):
        other = depth[min(max(v + dv, 0), height - 1), min(max(u + du, 0), width - 1)]
        if other > 0.0 and abs(other - z) > JUMP * z:
            # The pixel's centre is on its own surface, so the neighbour fills less than half of it.
            here, there = (1.0 - share / 2) / (z * z), share / 2 / (other * other)
            return (here * z + there * other) / (here + there)
    return z
