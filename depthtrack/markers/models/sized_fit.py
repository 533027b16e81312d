"""Fit of pose and hand sizes to assigned markers: the most probable hand that carries them.

The energy is half the weighted sum of squared residuals, half a quadratic prior on the sizes, and half one on the
finger angles: the negative logarithm of the posterior density up to a constant, without unit. It is minimised as in
`solver.gauss_newton`, with projected and damped steps that are halved until they decrease it.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.hand.compiled_kinematics import BodyPoses
from depthtrack.hand.compiled_tangent import retract
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.size_parameters import COUNT, prior_covariance, resized
from depthtrack.hand.synergies import load_synergies
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.markers.models.sized_markers import (
    COLUMNS,
    SizedMarkers,
    marker_jacobian,
    place_markers,
    set_sizes,
)
from depthtrack.solver.linear_algebra import cholesky_solve, hold_parameter
from depthtrack.types import Array, Index

_HELD = 1e-3
"""Standard deviation of calibrated sizes in a fit: a tenth of a percent."""
_SMALLEST_GAIN = 1e-4
"""Decrease of the energy, without unit, below which a fit ends."""


@dataclass(frozen=True)
class PosturePrior:
    """Normal distribution of finger angles.

    mean: (20,) rad.
    precision: (20, 20) rad^-2.
    """

    mean: Array
    precision: Array

    @staticmethod
    def from_synergies(widening: float, residual: float) -> "PosturePrior":
        """Return a wider distribution than that of the synergies of depthtrack.

        widening: factor of the standard deviation along each synergy.
        residual: standard deviation of an angle about its synergies, rad.
        """
        s = load_synergies()
        covariance = s.components * (widening**2 * s.variances) @ s.components.T + residual**2 * np.eye(20)
        return PosturePrior(np.array(s.mean), np.asarray(np.linalg.inv(covariance), dtype=np.float64))

    def energy(self, angles: Array) -> float:
        """Return the energy of angles (20,), rad."""
        d = angles - self.mean
        return 0.5 * float(d @ self.precision @ d)


@dataclass(frozen=True, eq=False)
class SizedFitter:
    """A hand or a rigid body to fit.

    model: with the layout or calibrated offsets.
    noise: standard deviation of a measured point about its marker beside the spread of the model, metres.
    prior: on the finger angles.
    iterations: largest number of steps.
    """

    model: MarkerModel
    noise: float
    prior: PosturePrior
    iterations: int = 15

    @cached_property
    def markers(self) -> SizedMarkers:
        """The markers, whose sizes each fit sets."""
        return SizedMarkers.of(self.model)

    @cached_property
    def weights(self) -> Array:
        """The weight (M,) of the squared residual of each marker, m^-2."""
        return 1 / (self.noise**2 + self.model.spread**2)

    @cached_property
    def size_precision(self) -> Array:
        """The inverse covariance (35, 35) of the sizes; calibrated sizes are held.

        Their errors are shared with those of the offsets: both place the markers where they were measured.
        """
        if self.model.size_spread is not None:
            return np.eye(COUNT) / _HELD**2
        return np.asarray(np.linalg.inv(prior_covariance()))

    def fit(self, pose: Array, sizes: Array, points: Array, assigned: Index) -> tuple[float, Array]:
        """Fit pose (27,) and sizes (35,) in place; return energy and markers (M, 3), metres.

        points: (K, 3) metres, capture frame.
        assigned: (M,) point of each marker, -1 for none.
        """
        predicted = np.empty((len(assigned), 3))
        energy = fit_sized(
            self.markers,
            BodyPoses.empty(),
            pose,
            sizes,
            points,
            assigned,
            self.weights,
            self.size_precision,
            self.prior.mean,
            self.prior.precision,
            LOWER,
            UPPER,
            self.model.is_rigid,
            self.iterations,
            predicted,
        )
        return energy, predicted

    def fitted_model(self, sizes: Array) -> MarkerModel:
        """Return the model with fitted sizes (35,); the offsets stretch with them."""
        if self.model.hand is None:
            return self.model
        set_sizes(self.markers, sizes)
        return self.model.with_(hand=resized(self.model.hand, sizes), offsets=self.markers.local.copy())


@compiled(nogil=True)
def fit_sized(
    markers: SizedMarkers,
    bodies: BodyPoses,
    pose: Array,
    sizes: Array,
    points: Array,
    assigned: Index,
    weights: Array,
    size_precision: Array,
    angle_mean: Array,
    angle_precision: Array,
    lower: Array,
    upper: Array,
    rigid: bool,
    iterations: int,
    predicted: Array,
) -> float:
    """Minimise the energy from pose (27,) and sizes (35,), both changed in place; return it.

    predicted: (M, 3) receives the markers. The rest as in `SizedFitter.fit`.
    """
    n = 6 if rigid else COLUMNS
    A, b, J = np.empty((n, n)), np.empty(n), np.empty((3, COLUMNS))
    trial, trial_sizes, tangent = np.empty(27), sizes.copy(), np.zeros(26)
    set_sizes(markers, sizes)
    place_markers(markers, bodies, pose, predicted)
    current = _energy(
        pose, sizes, points, assigned, weights, size_precision, angle_mean, angle_precision, rigid, predicted
    )
    for _ in range(iterations):
        A[:], b[:] = 0.0, 0.0
        for i in range(assigned.shape[0]):
            k = assigned[i]
            if k < 0:
                continue
            marker_jacobian(markers, bodies, i, predicted[i], sizes, J)
            _accumulate(A, b, J, predicted[i] - points[k], weights[i])
        for i in range(6):
            A[i, i] += 1e-6
        if not rigid:
            _add_priors(A, b, pose, sizes, size_precision, angle_mean, angle_precision)
            for j in range(20):
                if (pose[7 + j] <= lower[j] and b[6 + j] > 0) or (pose[7 + j] >= upper[j] and b[6 + j] < 0):
                    hold_parameter(A, b, 6 + j)
        if not cholesky_solve(A, b):
            break
        length, gain = 1.0, 0.0
        for _ in range(5):
            for j in range(6):
                tangent[j] = -length * b[j]
            if not rigid:
                for j in range(20):
                    turned = min(max(pose[7 + j] - length * b[6 + j], lower[j]), upper[j])
                    tangent[6 + j] = turned - pose[7 + j]
                for j in range(COUNT):
                    trial_sizes[j] = sizes[j] - length * b[26 + j]
                set_sizes(markers, trial_sizes)
            retract(pose, tangent, trial)
            place_markers(markers, bodies, trial, predicted)
            energy = _energy(
                trial,
                trial_sizes,
                points,
                assigned,
                weights,
                size_precision,
                angle_mean,
                angle_precision,
                rigid,
                predicted,
            )
            gain = current - energy
            if gain > 0:
                break
            length *= 0.5
        if not gain > 0:
            break
        pose[:], sizes[:], current = trial, trial_sizes, energy
        if gain < _SMALLEST_GAIN:
            break
    set_sizes(markers, sizes)
    place_markers(markers, bodies, pose, predicted)
    return current


@compiled(nogil=True)
def _accumulate(A: Array, b: Array, J: Array, e: Array, weight: float) -> None:
    """Add a marker to A (n, n) and b (n,); most of its Jacobian J (3, 61) is zero."""
    n = b.shape[0]
    columns, count = np.empty(n, np.int64), 0
    for j in range(n):
        if J[0, j] != 0.0 or J[1, j] != 0.0 or J[2, j] != 0.0:
            columns[count] = j
            count += 1
    for p in range(count):
        j = columns[p]
        b[j] += weight * (J[0, j] * e[0] + J[1, j] * e[1] + J[2, j] * e[2])
        for q in range(count):
            i = columns[q]
            A[j, i] += weight * (J[0, j] * J[0, i] + J[1, j] * J[1, i] + J[2, j] * J[2, i])


@compiled(nogil=True)
def _add_priors(
    A: Array, b: Array, pose: Array, sizes: Array, size_precision: Array, angle_mean: Array, angle_precision: Array
) -> None:
    for i in range(20):
        for j in range(20):
            A[6 + i, 6 + j] += angle_precision[i, j]
            b[6 + i] += angle_precision[i, j] * (pose[7 + j] - angle_mean[j])
    for i in range(sizes.shape[0]):
        for j in range(sizes.shape[0]):
            A[26 + i, 26 + j] += size_precision[i, j]
            b[26 + i] += size_precision[i, j] * sizes[j]


@compiled(nogil=True)
def _energy(
    pose: Array,
    sizes: Array,
    points: Array,
    assigned: Index,
    weights: Array,
    size_precision: Array,
    angle_mean: Array,
    angle_precision: Array,
    rigid: bool,
    predicted: Array,
) -> float:
    total = 0.0
    for i in range(assigned.shape[0]):
        k = assigned[i]
        if k >= 0:
            for j in range(3):
                d = predicted[i, j] - points[k, j]
                total += weights[i] * d * d
    if rigid:
        return 0.5 * total
    for i in range(20):
        for j in range(20):
            total += (pose[7 + i] - angle_mean[i]) * angle_precision[i, j] * (pose[7 + j] - angle_mean[j])
    for i in range(sizes.shape[0]):
        for j in range(sizes.shape[0]):
            total += sizes[i] * size_precision[i, j] * sizes[j]
    return 0.5 * total
