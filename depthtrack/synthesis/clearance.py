"""Self-collision of a hand: penetration depth between fingers, and of fingers into the palm.

Phalanges are tapered capsules and the palm is a slab. Soft tissue yields by a few millimetres, so a small penetration
is natural. A finger that passes through another one penetrates by 10 mm and more.
"""

from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.types import Array, Index


class Clearance:
    """Self-collision test for a hand of given sizes."""

    def __init__(self, shape: HandShape) -> None:
        self._shape = shape
        self._model = HandModel(shape)

    def penetration(self, poses: ArrayLike) -> Array:
        """Return the largest penetration depth of each pose.

        poses (..., 27): see `hand.pose`.
        Result (...,): metres; 0 without contact.
        """
        points = self._model.endpoints(poses)
        points = points.reshape(*points.shape[:-2], 5, 4, 3)
        start, end = self._skin_ends(points)
        return np.maximum(self._between_fingers(start, end), self._into_palm(poses, end))

    @cached_property
    def _radii(self) -> Array:
        """Return the fingers' radii (5, 4) at base, two joints and tip, metres."""
        return self._shape.radii * self._shape.scale

    @cached_property
    def _pairs(self) -> tuple[Index, Index]:
        """Return the pairs of phalanges (3 * finger + k) to test.

        Two proximal phalanges share soft tissue at the knuckles, so their pairs are excluded.
        """
        pairs = [
            (3 * f + i, 3 * g + j)
            for f, g in combinations(range(5), 2)
            for i in range(3)
            for j in range(3)
            if not (i == 0 and j == 0)
        ]
        first, second = zip(*pairs, strict=True)
        return np.array(first), np.array(second)

    def _skin_ends(self, points: Array) -> tuple[Array, Array]:
        """Return the ends of the capsules' axes (..., 5, 3, 3).

        The last capsule ends one radius before the fingertip.
        """
        start, end = points[..., :-1, :], points[..., 1:, :].copy()
        tip = end[..., 2, :] - start[..., 2, :]
        length = np.linalg.norm(tip, axis=-1, keepdims=True)
        end[..., 2, :] -= tip * np.minimum(self._radii[:, 3:] / length, 0.99)
        return start, end

    def _between_fingers(self, start: Array, end: Array) -> Array:
        """Return the depth (...,) of the worst overlap of two phalanges.

        It is measured between the closest points of both axes; `geometry.capsules` has one capsule and a point.
        """
        flat = (*start.shape[:-3], 15, 3)
        start, end = start.reshape(flat), end.reshape(flat)
        r0, r1 = self._radii[:, :-1].ravel(), self._radii[:, 1:].ravel()
        a, b = self._pairs
        distance, s, t = closest_points_of_segments(start[..., a, :], end[..., a, :], start[..., b, :], end[..., b, :])
        radii = r0[a] + s * (r1 - r0)[a] + r0[b] + t * (r1 - r0)[b]
        return np.maximum(radii - distance, 0).max(axis=-1)

    def _into_palm(self, poses: ArrayLike, ends: Array) -> Array:
        """Return how deep the distal ends of the middle and last phalanges lie in the palm's slab."""
        T = self._model.transforms(poses)[..., 0, :, :]
        local = np.einsum("...ji,...fkj->...fki", T[..., :3, :3], ends - T[..., None, None, :3, 3])[..., 1:, :]
        shape, radii = self._shape, self._radii[:, 2:]
        half = np.array([shape.palm_breadth, shape.palm_length]) / 2 * shape.scale
        inside = np.all(np.abs(local[..., :2]) < 0.9 * half, axis=-1) & (local[..., 2] > -radii)
        depth = shape.palm_thickness / 2 * shape.scale + radii - local[..., 2]
        return np.max(np.where(inside, np.maximum(depth, 0), 0), axis=(-1, -2))


def closest_points_of_segments(p0: Array, p1: Array, q0: Array, q1: Array) -> tuple[Array, Array, Array]:
    """Return the distance of two line segments and the parameters of their closest points.

    p0, p1, q0, q1 (..., 3): ends of the segments, metres.
    Result (...,) three times: distance in metres, and the parameters along p and q, 0 to 1.
    Source: Ericson, "Real-Time Collision Detection", 2005, Sec. 5.1.9.
    """
    u, v, w = p1 - p0, q1 - q0, p0 - q0
    a, e = (u * u).sum(-1), (v * v).sum(-1)
    b, c, f = (u * v).sum(-1), (u * w).sum(-1), (v * w).sum(-1)
    denominator = a * e - b * b
    s = np.clip(np.where(denominator > 1e-12, (b * f - c * e) / np.maximum(denominator, 1e-12), 0), 0, 1)
    t = (b * s + f) / e
    s = np.where(t < 0, np.clip(-c / a, 0, 1), np.where(t > 1, np.clip((b - c) / a, 0, 1), s))
    t = np.clip(t, 0, 1)
    gap = w + u * s[..., None] - v * t[..., None]
    return np.linalg.norm(gap, axis=-1), s, t
