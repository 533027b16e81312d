"""Tessellate the 37 primitives for renderers of triangles."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from trimesh.creation import icosphere

from depthtrack.hand.primitives import SPHERE, Primitives
from depthtrack.types import Array, Faces, Index


@dataclass(frozen=True)
class Tessellation:
    """Triangles in the frames of their bodies.

    vertices: (V, 3), m, in the frame of the body.
    bodies: (V,) body of each vertex, 0 to 15.
    faces: (F, 3) vertices of each triangle.
    """

    vertices: Array
    bodies: Index
    faces: Faces

    @classmethod
    def of(cls, primitives: Primitives, subdivisions: int = 2) -> Self:
        """Return the triangles of primitives.

        subdivisions: subdivisions of the icosahedra of spheres (2 gives 320 triangles); cylinders are equally fine.

        Vertices are on the true surface, so a facet of side e is up to e^2 / 6 radii inside it. Cylinders are open,
        since a sphere or ellipsoid closes each end in the hand.
        """
        units = {SPHERE: _unit_sphere(subdivisions)}
        vertices, bodies, faces, count = [], [], [], 0
        for kind, body, T in zip(primitives.kinds, primitives.bodies, primitives.T_body_unit, strict=True):
            unit, triangles = units.get(kind) or _unit_cylinder(6 * 2**subdivisions)
            # The homography of a cone transforms the cylinder in homogeneous coordinates; lines remain lines.
            transformed = np.column_stack([unit, np.ones(len(unit))]) @ T.T
            vertices.append(transformed[:, :3] / transformed[:, 3:])
            bodies.append(np.full(len(unit), body))
            faces.append(triangles + count)
            count += len(unit)
        return cls(np.concatenate(vertices), np.concatenate(bodies), np.concatenate(faces))

    def posed(self, transforms: Array) -> Array:
        """Return the vertices (V, 3) in the camera frame, m.

        transforms: (16, 4, 4) T_camera_body.
        """
        T = transforms[self.bodies]
        return np.einsum("vij,vj->vi", T[:, :3, :3], self.vertices) + T[:, :3, 3]


def _unit_sphere(subdivisions: int) -> tuple[Array, Faces]:
    mesh = icosphere(subdivisions)
    return np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64)


def _unit_cylinder(sides: int) -> tuple[Array, Faces]:
    """Return x^2 + y^2 = 1 with 0 <= z <= 1; triangles are counter-clockwise from outside."""
    around = np.arange(sides)
    angle = 2 * np.pi * around / sides
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    vertices = np.concatenate([np.column_stack([ring, np.full(sides, z)]) for z in (0.0, 1.0)])
    after = (around + 1) % sides
    lower = np.column_stack([around, after, around + sides])
    upper = np.column_stack([after, after + sides, around + sides])
    return vertices, np.concatenate([lower, upper])
