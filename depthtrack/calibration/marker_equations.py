"""Normal equations of a frame of labelled markers: pose, hand sizes and offsets.

Parameters are the pose's tangent space (26), the sizes (35), and the change of each offset (3 M, metres, body frames)
before it stretches with the sizes.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.hand.compiled_kinematics import BodyPoses
from depthtrack.hand.size_parameters import COUNT
from depthtrack.markers.models.sized_fit import SizedFitter
from depthtrack.markers.models.sized_markers import (
    COLUMNS,
    SizedMarkers,
    marker_jacobian,
    offset_stretch,
    place_markers,
    set_sizes,
)
from depthtrack.types import Array

if TYPE_CHECKING:
    from depthtrack.calibration.options import MarkerCalibrationOptions


@dataclass(frozen=True, eq=False)
class MarkerParameters:
    """What all frames of a calibration share.

    markers: of the model; `values` set its sizes and offsets.
    offsets: (M, 3) of the model, metres.
    weight: 1 / variance of a measured point, m^-2.
    angle_mean, angle_precision: (20,), (20, 20) of the prior on postures.
    """

    markers: SizedMarkers
    offsets: Array
    weight: float
    angle_mean: Array
    angle_precision: Array

    @staticmethod
    def of(fitter: SizedFitter, options: "MarkerCalibrationOptions") -> "MarkerParameters":
        """Return the parameters of a model."""
        markers = SizedMarkers.of(fitter.model)
        prior = fitter.prior
        return MarkerParameters(markers, markers.offsets.copy(), 1 / options.noise**2, prior.mean, prior.precision)

    def set(self, values: Array) -> None:
        """Set sizes and offsets to `values` (35 + 3 M,)."""
        self.markers.offsets[:] = self.offsets + values[COUNT:].reshape(-1, 3)
        set_sizes(self.markers, values[:COUNT])

    def local(self, values: Array) -> Array:
        """Return the offsets (M, 3), metres, on the hand of these sizes."""
        self.set(values)
        return self.markers.local.copy()

    def positions(self, values: Array, pose: Array) -> Array:
        """Return the markers (M, 3), metres, capture frame."""
        self.set(values)
        placed = np.empty_like(self.offsets)
        place_markers(self.markers, BodyPoses.empty(), pose, placed)
        return placed


def frame_energy(parameters: MarkerParameters, values: Array, pose: Array, points: Array, kernel: float) -> float:
    """Return the energy of a frame: half the robust squared residuals, and that of its posture.

    points: (M, 3) metres, NaN if not measured.
    kernel: scale of the Geman-McClure kernel, metres.
    """
    square = np.square(parameters.positions(values, pose) - points).sum(axis=-1)
    square = square[np.isfinite(square)]
    d = pose[7:] - parameters.angle_mean
    robust = float((square / (1 + square / kernel**2)).sum())
    return 0.5 * parameters.weight * robust + 0.5 * float(d @ parameters.angle_precision @ d)


def frame_equations(
    parameters: MarkerParameters, values: Array, pose: Array, points: Array, kernel: float
) -> tuple[Array, Array]:
    """Return J^T W J (26 + 35 + 3 M square) and J^T W e of `frame_energy`."""
    parameters.set(values)
    n = COLUMNS + 3 * len(points)
    H, g, placed = np.zeros((n, n)), np.zeros(n), np.empty_like(points)
    bodies = BodyPoses.empty()
    place_markers(parameters.markers, bodies, pose, placed)
    add_markers(parameters.markers, bodies, values[:COUNT], placed, points, parameters.weight, kernel, H, g)
    H[6:26, 6:26] += parameters.angle_precision
    g[6:26] += parameters.angle_precision @ (pose[7:] - parameters.angle_mean)
    return H, g


@compiled(nogil=True)
def add_markers(
    markers: SizedMarkers,
    bodies: BodyPoses,
    sizes: Array,
    placed: Array,
    points: Array,
    weight: float,
    kernel: float,
    H: Array,
    g: Array,
) -> None:
    """Add the markers of a frame to the normal equations.

    placed, points: (M, 3) metres, capture frame; NaN points are left out.
    """
    J, columns = np.zeros((3, COLUMNS + 3)), np.empty(COLUMNS + 3, np.int64)
    for i in range(points.shape[0]):
        e = placed[i] - points[i]
        square = e[0] * e[0] + e[1] * e[1] + e[2] * e[2]
        if not np.isfinite(square):
            continue
        share = 1 / (1 + square / (kernel * kernel))
        w = weight * share * share
        marker_jacobian(markers, bodies, i, placed[i], sizes, J[:, :COLUMNS])
        b = markers.bodies[i]
        stretch = offset_stretch(sizes, b)
        for j in range(3):
            for r in range(3):
                J[r, COLUMNS + j] = bodies.T[b, r, j] * stretch[j]
        count = 0
        for j in range(COLUMNS + 3):
            if J[0, j] != 0.0 or J[1, j] != 0.0 or J[2, j] != 0.0:
                columns[count] = j
                count += 1
        for p in range(count):
            j = columns[p]
            row = j if j < COLUMNS else j + 3 * i
            g[row] += w * (J[0, j] * e[0] + J[1, j] * e[1] + J[2, j] * e[2])
            for q in range(count):
                k = columns[q]
                column = k if k < COLUMNS else k + 3 * i
                H[row, column] += w * (J[0, j] * J[0, k] + J[1, j] * J[1, k] + J[2, j] * J[2, k])
