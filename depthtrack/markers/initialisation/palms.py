"""Palms to search fingers on: positions and orientations at which markers meet points.

Two sources. Three markers of the palm and three points with similar distances determine a palm. And typical postures,
turned in many ways, are aligned to the points by iterative closest points, which needs no marker of the palm.
"""

from itertools import combinations

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.geometry.rotations import rotation_matrix
from depthtrack.hand.pose import make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.types import Array, Index

_POSTURES = ("open", "relaxed", "grasp", "fist", "point")
_TRIPLES = 4
"""Most triples of palm markers that are matched with points."""
_MOST_PALMS = 20_000
_ICP_STEPS = 8
_NEAR_CENTRE = 0.03
"""Centres of neighbourhoods nearer to each other than this are one, metres."""


def palms_of_triples(model: MarkerModel, deviation: Array, points: Array) -> Array:
    """Return T (P, 3, 4) of palms whose markers are near three points, metres.

    deviation: (M,) standard deviation of the markers about those of the model, metres.
    points: (K, 3) metres.
    """
    mine = np.flatnonzero(np.asarray(model.bodies) == 0)
    if len(mine) < 3 or len(points) < 3:
        return np.empty((0, 3, 4))
    triples = np.array(list(combinations(mine, 3)))
    corners = model.offsets[triples]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=-1)
    best = triples[np.argsort(-area)[:_TRIPLES]]
    found = np.empty((_MOST_PALMS, 3, 4))
    count = match_triples(np.array(model.offsets), best, deviation, points, found)
    return found[:count].copy()


@compiled(nogil=True)
def match_triples(offsets: Array, triples: Index, deviation: Array, points: Array, found: Array) -> int:
    """Write the transforms of all triples with similar distances; return their number.

    Distances agree within three deviations.

    offsets: (M, 3) metres, palm frame. triples: (N, 3) markers. points: (K, 3) metres. found: (P, 3, 4).
    """
    K, count = points.shape[0], 0
    D = np.empty((K, K))
    for i in range(K):
        for j in range(K):
            D[i, j] = np.sqrt(np.sum((points[i] - points[j]) ** 2))
    source, target = np.empty((3, 3)), np.empty((3, 3))
    for n in range(triples.shape[0]):
        a, b, c = triples[n, 0], triples[n, 1], triples[n, 2]
        ab = np.sqrt(np.sum((offsets[a] - offsets[b]) ** 2))
        bc = np.sqrt(np.sum((offsets[b] - offsets[c]) ** 2))
        ca = np.sqrt(np.sum((offsets[c] - offsets[a]) ** 2))
        slack_ab = 3 * np.sqrt(deviation[a] ** 2 + deviation[b] ** 2)
        slack_bc = 3 * np.sqrt(deviation[b] ** 2 + deviation[c] ** 2)
        slack_ca = 3 * np.sqrt(deviation[c] ** 2 + deviation[a] ** 2)
        triangle_frame(offsets[a], offsets[b], offsets[c], source)
        for i in range(K):
            for j in range(K):
                if i == j or abs(D[i, j] - ab) > slack_ab:
                    continue
                for k in range(K):
                    if k in (i, j) or abs(D[j, k] - bc) > slack_bc or abs(D[k, i] - ca) > slack_ca:
                        continue
                    if not triangle_frame(points[i], points[j], points[k], target):
                        continue
                    if count == found.shape[0]:
                        return count
                    for r in range(3):
                        t = (points[i, r] + points[j, r] + points[k, r]) / 3
                        for q in range(3):
                            R = 0.0
                            for axis in range(3):
                                R += target[axis, r] * source[axis, q]
                            found[count, r, q] = R
                            t -= R * (offsets[a, q] + offsets[b, q] + offsets[c, q]) / 3
                        found[count, r, 3] = t
                    count += 1
    return count


@compiled(nogil=True)
def triangle_frame(a: Array, b: Array, c: Array, axes: Array) -> bool:
    """Write the axes of a triangle as rows (3, 3); return False if it has no area.

    The first axis bisects the direction of the edge a-b and that of the median from c, so that each corner counts.
    """
    u, m = b - a, c - (a + b) / 2
    n = np.cross(u, m)
    area = np.sqrt(np.sum(n * n))
    length = np.sqrt(np.sum(u * u))
    if not (length > 1e-6 and area > 0.05 * length * length * 0.1):
        return False
    n /= area
    u /= length
    across = np.cross(n, u)
    # The mean turn of the three corners about the normal: the median's lean against the edge is shared.
    lean = np.arctan2(np.sum(m * u), np.sum(m * across)) / 2
    cosine, sine = np.cos(lean), np.sin(lean)
    axes[0] = cosine * u - sine * across
    axes[1] = sine * u + cosine * across
    axes[2] = n
    return True


def palms_of_postures(model: MarkerModel, points: Array, rotations: int) -> Array:
    """Return T (P, 3, 4) of palms by ICP of typical postures from many orientations, metres."""
    R = rotation_matrix(spread_quaternions(rotations))
    rest = [make_pose(np.zeros(3), (1, 0, 0, 0), POSTURES[name]) for name in _POSTURES]
    shapes = np.ascontiguousarray(np.stack([model.positions(pose) for pose in rest]))
    centres = neighbourhood_centres(points, len(model.labels))
    found = np.empty((len(shapes) * len(centres) * len(R), 3, 4))
    align_postures(shapes, np.ascontiguousarray(R), centres, points, found)
    return found


def spread_quaternions(count: int) -> Array:
    """Return (N, 4) unit quaternions, evenly spread over the rotations.

    Source: Alexa, "Super-Fibonacci spirals: fast, low-discrepancy sampling of SO(3)", CVPR 2022.
    """
    s = np.arange(count) + 0.5
    r, R = np.sqrt(s / count), np.sqrt(1 - s / count)
    alpha, beta = 2 * np.pi * s / np.sqrt(2), 2 * np.pi * s / 1.533751168755204288118041
    return np.stack([r * np.sin(alpha), r * np.cos(alpha), R * np.sin(beta), R * np.cos(beta)], axis=-1)


def neighbourhood_centres(points: Array, size: int) -> Array:
    """Return the centres (C, 3), metres, of the `size` points nearest to each point, once each."""
    D = np.linalg.norm(points[:, None] - points, axis=-1)
    nearest = np.argsort(D, axis=1, kind="stable")[:, :size]
    spread = np.take_along_axis(D, nearest, axis=1).sum(axis=1)
    kept: list[Array] = []
    for k in np.argsort(spread, kind="stable"):
        centre = points[nearest[k]].mean(axis=0)
        if all(np.linalg.norm(centre - other) > _NEAR_CENTRE for other in kept):
            kept.append(centre)
    return np.stack(kept)


@compiled(nogil=True)
def align_postures(shapes: Array, R: Array, centres: Array, points: Array, found: Array) -> None:
    """Write the transform of each shape, rotation and centre after a few ICP steps.

    shapes: (S, M, 3) palm frame. R: (N, 3, 3). centres: (C, 3). points: (K, 3).
    found: (S C N, 3, 4).
    """
    M, K, n = shapes.shape[1], points.shape[0], 0
    nearest = np.empty(M, np.int64)
    for s in range(shapes.shape[0]):
        shape = shapes[s]
        middle = np.zeros(3)
        for i in range(M):
            middle += shape[i] / M
        for centre in centres:
            for q in range(R.shape[0]):
                T = found[n]
                T[:, :3] = R[q]
                T[:, 3] = centre - R[q] @ middle
                for _ in range(_ICP_STEPS):
                    changed = False
                    for i in range(M):
                        x0 = T[0, 0] * shape[i, 0] + T[0, 1] * shape[i, 1] + T[0, 2] * shape[i, 2] + T[0, 3]
                        x1 = T[1, 0] * shape[i, 0] + T[1, 1] * shape[i, 1] + T[1, 2] * shape[i, 2] + T[1, 3]
                        x2 = T[2, 0] * shape[i, 0] + T[2, 1] * shape[i, 1] + T[2, 2] * shape[i, 2] + T[2, 3]
                        best, chosen = np.inf, 0
                        for k in range(K):
                            d0, d1, d2 = x0 - points[k, 0], x1 - points[k, 1], x2 - points[k, 2]
                            d = d0 * d0 + d1 * d1 + d2 * d2
                            if d < best:
                                best, chosen = d, k
                        if nearest[i] != chosen:
                            changed = True
                        nearest[i] = chosen
                    if not changed:
                        break
                    align_to(shape, points, nearest, T)
                n += 1


@compiled(nogil=True)
def align_to(shape: Array, points: Array, nearest: Index, T: Array) -> None:
    """Write the least squares alignment of shape (M, 3) to its points to T (3, 4).

    Source: Kabsch, Acta Cryst. A32, 1976.
    """
    M = shape.shape[0]
    p, q, C = np.zeros(3), np.zeros(3), np.zeros((3, 3))
    for i in range(M):
        p += shape[i] / M
        q += points[nearest[i]] / M
    for i in range(M):
        for a in range(3):
            for b in range(3):
                C[a, b] += (points[nearest[i], a] - q[a]) * (shape[i, b] - p[b])
    U, _, Vt = np.linalg.svd(C)
    if np.linalg.det(U) * np.linalg.det(Vt) < 0:
        U[:, 2] *= -1
    R = U @ Vt
    T[:, :3] = R
    T[:, 3] = q - R @ p
