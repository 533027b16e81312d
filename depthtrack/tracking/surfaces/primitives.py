"""Surface of the 37 spheres and cylinders that hypotheses are rendered with."""

import numpy as np
from numpy.typing import NDArray

from depthtrack.compilation import compiled
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.primitives import SPHERE, Primitives
from depthtrack.hand.shape import HandShape
from depthtrack.solver.surface_points import SurfacePoints
from depthtrack.tracking.surfaces.subsampling import subsample_evenly
from depthtrack.types import Array, Index, Mask

SAMPLES = 1600
"""Points of each primitive before subsampling."""
INSIDE = 0.98
"""Scale of the unit primitives within which a point counts as inside one."""


def primitive_points(shape: HandShape, spacing: float) -> SurfacePoints:
    """Return points on the primitives at least `spacing` palm lengths apart.

    Points inside another primitive in every typical posture are left out.
    """
    primitives, model = Primitives.of(shape), HandModel(shape)
    parts = [sample_primitive(int(kind), T) for kind, T in zip(primitives.kinds, primitives.T_body_unit, strict=True)]
    local, normals = (np.concatenate([part[i] for part in parts]) for i in range(2))
    owner = np.repeat(np.arange(len(parts)), [len(points) for points, _ in parts])
    hidden = np.arange(len(local))
    for angles in POSTURES.values():
        T = model.transforms(make_pose(np.zeros(3), (1, 0, 0, 0), angles))
        hidden = hidden[inside_others(primitives, T, local[hidden], owner[hidden])]
    local, normals, owner = (np.delete(each, hidden, axis=0) for each in (local, normals, owner))
    bodies = primitives.bodies[owner]
    T_rest_body = model.transforms(make_pose(np.zeros(3), (1, 0, 0, 0), POSTURES["open"]))
    R, t = T_rest_body[bodies, :3, :3], T_rest_body[bodies, :3, 3]
    rest = np.einsum("nij,nj->ni", R, local) + t
    pick = subsample_evenly(rest, spacing * shape.palm_length * shape.scale)
    return SurfacePoints(
        np.ascontiguousarray(rest[pick]),
        np.ascontiguousarray(np.einsum("nij,nj->ni", R, normals)[pick]),
        np.ascontiguousarray(np.column_stack([bodies[pick], np.zeros((len(pick), 3), np.int64)])),
        np.ascontiguousarray(np.tile([1.0, 0.0, 0.0, 0.0], (len(pick), 1))),
        np.ascontiguousarray(np.linalg.inv(T_rest_body)[:, :3]),
    )


def sample_primitive(kind: int, T: Array) -> tuple[Array, Array]:
    """Return points and outward unit normals (N, 3) of a transformed unit primitive.

    T: (4, 4) homogeneous transform, possibly projective.

    A quadric u^T Q u = 0 maps to x^T T^-T Q T^-1 x = 0, whose gradient is the normal.
    """
    golden, n = np.pi * (3 - np.sqrt(5)), np.arange(SAMPLES)
    share = (n + 0.5) / SAMPLES
    if kind == SPHERE:
        z = 1 - 2 * share
        unit = np.column_stack([np.sqrt(1 - z * z) * np.cos(golden * n), np.sqrt(1 - z * z) * np.sin(golden * n), z])
        Q = np.diag([1.0, 1.0, 1.0, -1.0])
    else:
        unit = np.column_stack([np.cos(golden * n), np.sin(golden * n), share])
        Q = np.diag([1.0, 1.0, 0.0, -1.0])
    x = np.column_stack([unit, np.ones(SAMPLES)]) @ T.T
    x /= x[:, 3:]
    inverse = np.linalg.inv(T)
    gradient = (x @ (inverse.T @ Q @ inverse))[:, :3]
    return x[:, :3], gradient / np.linalg.norm(gradient, axis=1, keepdims=True)


def inside_others(primitives: Primitives, T: Array, local: Array, owner: Index) -> Mask:
    """Return which points (N, 3) of the primitives `owner` (N,) lie inside another one.

    T: (16, 4, 4) frames of the bodies.
    local: points in the frames of their bodies, metres.
    """
    inside = np.zeros(len(local), np.bool_)
    into_units = np.linalg.inv(primitives.transforms(T))
    mark_inside(into_units, primitives.kinds == SPHERE, T[primitives.bodies], local, owner, inside)
    return inside


@compiled(nogil=True)
def mark_inside(
    into_units: Array, is_sphere: Mask, T: Array, local: Array, owner: Index, inside: NDArray[np.bool_]
) -> None:
    """Mark the points (N, 3) that lie inside another unit primitive than their owner.

    into_units: (P, 4, 4) from the camera to each unit primitive, possibly projective.
    T: (P, 4, 4) rigid frames of the bodies of the primitives.
    """
    square = INSIDE * INSIDE
    for n in range(local.shape[0]):
        frame, a, b, c = T[owner[n]], local[n, 0], local[n, 1], local[n, 2]
        px = frame[0, 0] * a + frame[0, 1] * b + frame[0, 2] * c + frame[0, 3]
        py = frame[1, 0] * a + frame[1, 1] * b + frame[1, 2] * c + frame[1, 3]
        pz = frame[2, 0] * a + frame[2, 1] * b + frame[2, 2] * c + frame[2, 3]
        for k in range(into_units.shape[0]):
            if k == owner[n]:
                continue
            m = into_units[k]
            x = m[0, 0] * px + m[0, 1] * py + m[0, 2] * pz + m[0, 3]
            y = m[1, 0] * px + m[1, 1] * py + m[1, 2] * pz + m[1, 3]
            z = m[2, 0] * px + m[2, 1] * py + m[2, 2] * pz + m[2, 3]
            w = m[3, 0] * px + m[3, 1] * py + m[3, 2] * pz + m[3, 3]
            across = x * x + y * y
            if is_sphere[k]:
                found = across + z * z < square * w * w
            else:
                found = across < square * w * w and z * w > 0.0 and z * w < w * w
            if found:
                inside[n] = True
                break
