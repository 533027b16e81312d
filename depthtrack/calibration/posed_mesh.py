"""Posing of a skin's mesh, compiled: linear blend skinning and normals of its vertices."""

import math
from typing import NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.hand.skin.mesh import Skin
from depthtrack.types import Array, Faces, Index


class PosableMesh(NamedTuple):
    """A mesh moved by bodies.

    rest: (V, 3) vertices at rest, metres.
    bodies, weights: (V, K) bodies that move each vertex and their weights, largest first.
    faces: (F, 3) counter-clockwise from outside.
    """

    rest: Array
    bodies: Index
    weights: Array
    faces: Faces

    @staticmethod
    def of(skin: Skin) -> "PosableMesh":
        """Return the mesh of a skin, with every body that moves a vertex."""
        most = int((skin.weights > 0).sum(axis=1).max())
        bodies = np.argsort(-skin.weights, axis=1, kind="stable")[:, :most]
        weights = np.take_along_axis(skin.weights, bodies, axis=1)
        return PosableMesh(
            np.ascontiguousarray(skin.rest),
            np.ascontiguousarray(bodies, dtype=np.int64),
            np.ascontiguousarray(weights),
            np.ascontiguousarray(skin.faces, dtype=np.int64),
        )


@compiled(nogil=True)
def posed_mesh(mesh: PosableMesh, moved: Array) -> tuple[Array, Array]:
    """Return vertices and outward unit normals (V, 3) of a posed mesh.

    They are those of `Skin.vertices` and `Skin.normals`.

    moved: (16, 4, 4) from the frame at rest to the camera frame, by each body.
    """
    count = mesh.rest.shape[0]
    x, n = np.empty((count, 3)), np.zeros((count, 3))
    for v in range(count):
        for i in range(3):
            total = 0.0
            for k in range(mesh.bodies.shape[1]):
                weight = mesh.weights[v, k]
                if weight == 0.0:
                    break
                T = moved[mesh.bodies[v, k], i]
                r = mesh.rest[v]
                total += weight * (T[0] * r[0] + T[1] * r[1] + T[2] * r[2] + T[3])
            x[v, i] = total
    for f in range(mesh.faces.shape[0]):
        a, b, c = mesh.faces[f, 0], mesh.faces[f, 1], mesh.faces[f, 2]
        ux, uy, uz = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
        vx, vy, vz = x[c, 0] - x[a, 0], x[c, 1] - x[a, 1], x[c, 2] - x[a, 2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        for k in range(3):
            corner = mesh.faces[f, k]
            n[corner, 0] += nx
            n[corner, 1] += ny
            n[corner, 2] += nz
    for v in range(count):
        length = max(math.sqrt(n[v, 0] ** 2 + n[v, 1] ** 2 + n[v, 2] ** 2), 1e-30)
        for i in range(3):
            n[v, i] /= length
    return x, n
