"""The 37 primitives as triangles, for renderers that know nothing else."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from trimesh.creation import icosphere

from depthtrack.hand.primitives import SPHERE, Primitives
from depthtrack.types import Array, Faces, Index


@dataclass(frozen=True)
class Tessellation:
    """Triangles in the frames of the 16 bodies that carry them.

    `vertices` (V, 3) metres, each in the frame of its body, `bodies` (V,), `faces` (F, 3).
    """

    vertices: Array
    bodies: Index
    faces: Faces

    @classmethod
    def of(cls, primitives: Primitives, subdivisions: int = 2) -> Self:
        """Spheres as icosahedra subdivided so many times (2: 320 triangles), cylinders with sides as fine.

        Corners lie on the true surface, so a facet of side e lies up to e^2 / 6 radii inside it. Cylinders are open:
        the hand closes every end with a sphere or ellipsoid.
        """
        units = {SPHERE: _unit_sphere(subdivisions)}
        vertices, bodies, faces, count = [], [], [], 0
        for kind, body, T in zip(primitives.kinds, primitives.bodies, primitives.T_body_unit, strict=True):
            unit, triangles = units.get(kind) or _unit_cylinder(6 * 2**subdivisions)
            # Homogeneous, so that a cylinder's homography makes it a cone; straight lines stay straight.
            placed = np.column_stack([unit, np.ones(len(unit))]) @ T.T
            vertices.append(placed[:, :3] / placed[:, 3:])
            bodies.append(np.full(len(unit), body))
            faces.append(triangles + count)
            count += len(unit)
        return cls(np.concatenate(vertices), np.concatenate(bodies), np.concatenate(faces))

    def posed(self, transforms: Array) -> Array:
        """Vertices (V, 3) in the camera frame for T_camera_body (16, 4, 4)."""
        T = transforms[self.bodies]
        return np.einsum("vij,vj->vi", T[:, :3, :3], self.vertices) + T[:, :3, 3]


def _unit_sphere(subdivisions: int) -> tuple[Array, Faces]:
    mesh = icosphere(subdivisions)
    return np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64)


def _unit_cylinder(sides: int) -> tuple[Array, Faces]:
    """ux^2 + uy^2 = 1 with 0 <= uz <= 1, its triangles counter-clockwise from outside."""
    around = np.arange(sides)
    angle = 2 * np.pi * around / sides
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    vertices = np.concatenate([np.column_stack([ring, np.full(sides, z)]) for z in (0.0, 1.0)])
    after = (around + 1) % sides
    lower = np.column_stack([around, after, around + sides])
    upper = np.column_stack([after, after + sides, around + sides])
    return vertices, np.concatenate([lower, upper])
