"""Parameters of the solver: all 26, or the global pose and a few synergies.

Source: Schroeder et al. 2014, Sec. V-A.
"""

from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.synergies import Synergies
from depthtrack.types import Array


class PostureSubspace(NamedTuple):
    """Subspace of finger angles: mean + basis @ coordinates, Eq. (6) and (7).

    The global pose stays free.

    basis: (20, l) orthonormal.
    mean: (20,) rad.
    lower, upper: (l,) limits of the coordinates.
    full: whether the coordinates are the plain angles (the basis is I).
    """

    basis: Array
    mean: Array
    lower: Array
    upper: Array
    full: bool

    @staticmethod
    def of(synergies: Synergies, count: int | None = None) -> "PostureSubspace":
        """Return the global pose and the first `count` synergies, by default all.

        Raises:
            InputError: if there are fewer synergies.
        """
        s = synergies if count is None else synergies.truncated(count)
        return PostureSubspace(
            np.ascontiguousarray(s.components), np.array(s.mean), np.array(s.lower), np.array(s.upper), False
        )

    def project(self, angles: Array) -> Array:
        """Return the coordinates (l,) of angles (20,), projected to the subspace and its limits."""
        coordinates = angles if self.full else (angles - self.mean) @ self.basis
        return np.minimum(np.maximum(coordinates, self.lower), self.upper)

    def angles(self, coordinates: Array) -> Array:
        """Return the angles (20,), rad, at coordinates (l,)."""
        return coordinates.copy() if self.full else self.mean + self.basis @ coordinates


FULL = PostureSubspace(np.eye(20), np.zeros(20), np.array(LOWER), np.array(UPPER), True)
"""All twenty angles within the limits of the hand."""


@compiled(nogil=True)
def write_angle_step(space: PostureSubspace, pose: Array, coordinates: Array, tangent: Array) -> None:
    """Write the change of the angles that leads to `coordinates` to `tangent`."""
    for j in range(20):
        if space.full:
            tangent[6 + j] = coordinates[j] - pose[7 + j]
        else:
            angle = space.mean[j]
            for i in range(coordinates.shape[0]):
                angle += space.basis[j, i] * coordinates[i]
            tangent[6 + j] = angle - pose[7 + j]


@compiled(nogil=True)
def reduce_to_subspace(H: Array, gradient: Array, space: PostureSubspace, A: Array, b: Array) -> None:
    """Write the normal equations of the subspace to A and b: J_PC = J M, Eq. (8)."""
    B, count, size = space.basis, space.basis.shape[1], b.shape[0]
    for i in range(size):
        kept = space.full or i < 6
        b[i] = gradient[i] if kept else 0.0
        for j in range(size):
            A[i, j] = H[i, j] if kept and (space.full or j < 6) else 0.0
    if space.full:
        return
    HB = np.empty(count)
    for j in range(20):
        row, first = 6 + j, j - j % 4
        for k in range(count):
            b[6 + k] += B[j, k] * gradient[row]
            # The angles of different fingers share no element of H.
            HB[k] = H[row, 6 + first] * B[first, k] + H[row, 7 + first] * B[first + 1, k]
            HB[k] += H[row, 8 + first] * B[first + 2, k] + H[row, 9 + first] * B[first + 3, k]
        for i in range(6):
            for k in range(count):
                A[i, 6 + k] += H[i, row] * B[j, k]
        for i in range(count):
            for k in range(i + 1):
                A[6 + i, 6 + k] += B[j, i] * HB[k]
    for i in range(6):
        for k in range(count):
            A[6 + k, i] = A[i, 6 + k]
    for i in range(count):
        for k in range(i):
            A[6 + k, 6 + i] = A[6 + i, 6 + k]
