"""A float64 z-buffer of triangle meshes: perspective-correct depth, label and normal."""

import math

import numpy as np
from numpy.typing import NDArray

from depthtrack.compilation import compiled
from depthtrack.geometry.camera import Camera
from depthtrack.rendering.rendered_surface import NEAR, RenderedSurface
from depthtrack.types import Array, Index


def rasterise(
    camera: Camera,
    vertices: Array,
    faces: Index,
    vertex_normals: Array,
    labels: Index,
    onto: RenderedSurface | None = None,
    closed: bool = False,
) -> RenderedSurface:
    """Render triangles from both sides; return the nearest hit at every pixel centre.

    vertices: (V, 3) metres, camera frame; a triangle with a vertex nearer than NEAR is left out.
    faces: (F, 3) vertex indices.
    vertex_normals: (V, 3) of any length, camera frame.
    labels: (F,) written at the pixels of each face.
    onto: a surface to draw over in place; a new one if None.
    closed: whether the faces close a solid and are counter-clockwise from outside; those that face away are left out.
    """
    surface = RenderedSurface.empty(camera) if onto is None else onto
    _rasterise(
        np.ascontiguousarray(vertices, dtype=np.float64),
        np.ascontiguousarray(faces, dtype=np.int64),
        np.ascontiguousarray(vertex_normals, dtype=np.float64),
        np.asarray(labels, dtype=np.int16),
        (camera.fx, camera.fy, camera.cx, camera.cy),
        closed,
        surface.depth,
        surface.label,
        surface.normal,
    )
    return surface


@compiled(nogil=True)
def _rasterise(
    vertices: Array,
    faces: Index,
    normals: Array,
    labels: NDArray[np.int16],
    intrinsics: tuple[float, float, float, float],
    closed: bool,
    depth: Array,
    label: NDArray[np.int16],
    normal: Array,
) -> None:
    fx, fy, cx, cy = intrinsics
    near = NEAR
    height, width = depth.shape
    pixels = np.empty((vertices.shape[0], 2))
    for k in range(vertices.shape[0]):
        z = max(vertices[k, 2], near)
        pixels[k, 0], pixels[k, 1] = fx * vertices[k, 0] / z + cx, fy * vertices[k, 1] / z + cy
    for f in range(faces.shape[0]):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        za, zb, zc = vertices[a, 2], vertices[b, 2], vertices[c, 2]
        if min(za, zb, zc) < near:
            continue
        ua, va = pixels[a, 0], pixels[a, 1]
        ub, vb = pixels[b, 0], pixels[b, 1]
        uc, vc = pixels[c, 0], pixels[c, 1]
        area = (ub - ua) * (vc - va) - (uc - ua) * (vb - va)
        if area == 0.0 or (closed and area > 0.0):
            continue
        sign_of_area = 1.0 if area > 0.0 else -1.0
        u0, u1 = max(0, math.ceil(min(ua, ub, uc))), min(width - 1, math.floor(max(ua, ub, uc)))
        v0, v1 = max(0, math.ceil(min(va, vb, vc))), min(height - 1, math.floor(max(va, vb, vc)))
        for v in range(v0, v1 + 1):
            for u in range(u0, u1 + 1):
                # Barycentric coordinates in the image; inverse depth is linear there.
                part_a = (ub - u) * (vc - v) - (uc - u) * (vb - v)
                part_b = (uc - u) * (va - v) - (ua - u) * (vc - v)
                # A division takes as long as the rest: most pixels around small triangles do without.
                if part_a * sign_of_area < 0.0 or part_b * sign_of_area < 0.0:
                    continue
                wa, wb = part_a / area, part_b / area
                wc = 1.0 - wa - wb
                if wc < 0.0:
                    continue
                pa, pb, pc = wa / za, wb / zb, wc / zc
                z = 1.0 / (pa + pb + pc)
                if depth[v, u] > 0.0 and z >= depth[v, u]:
                    continue
                nx = pa * normals[a, 0] + pb * normals[b, 0] + pc * normals[c, 0]
                ny = pa * normals[a, 1] + pb * normals[b, 1] + pc * normals[c, 1]
                nz = pa * normals[a, 2] + pb * normals[b, 2] + pc * normals[c, 2]
                length = max(math.sqrt(nx * nx + ny * ny + nz * nz), 1e-30)
                sign = 1.0 if nx * (u - cx) / fx + ny * (v - cy) / fy + nz <= 0.0 else -1.0
                depth[v, u] = z
                label[v, u] = labels[f]
                normal[v, u, 0] = sign * nx / length
                normal[v, u, 1] = sign * ny / length
                normal[v, u, 2] = sign * nz / length
