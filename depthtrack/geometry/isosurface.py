"""Turns an implicit solid, negative inside, into a closed triangle mesh: surface nets (Gibson 1998), then relaxation.

Surface nets put one vertex into every grid cell that the surface crosses and one quad across every grid edge that
it crosses. Where a cell holds two sheets of the surface the net would touch itself; such cells are filled first, so
that the mesh is a closed manifold whatever the solid.
"""

from collections.abc import Callable

import numpy as np
from scipy.sparse import csr_array

from depthtrack.types import Array, Faces, Index, Mask

Field = Callable[[Array], Array]
"""Signed values (N,), about the distance in metres near the surface, of points (N, 3)."""

_CORNERS = np.array([(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)])
_EDGES = [(a, b) for a in range(8) for b in range(a + 1, 8) if np.abs(_CORNERS[a] - _CORNERS[b]).sum() == 1]


def polygonise(field: Field, low: Array, high: Array, cell: float, rounds: int = 3) -> tuple[Array, Faces]:
    """Vertices (V, 3) and outward faces (F, 3) of the surface `field = 0` within the box from `low` to `high`.

    The box must enclose the solid with a cell to spare. `rounds` of relaxation spread the vertices evenly over the
    surface and put them exactly on it.
    """
    shape = np.ceil((high - low) / cell).astype(np.int64) + 1
    axes = [low[a] + cell * np.arange(shape[a]) for a in range(3)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    values = field(points.reshape(-1, 3)).reshape(points.shape[:3])
    vertices, quads = surface_nets(without_double_sheets(values))
    vertices = low + cell * vertices
    faces = _triangles(vertices, quads)
    for _ in range(rounds):
        vertices = _project(field, _relax(vertices, faces), 0.1 * cell)
    faces = _triangles(vertices, quads)
    return _project(field, vertices, 0.1 * cell), faces


def surface_nets(values: Array) -> tuple[Array, Index]:
    """Vertices (V, 3) in grid units and outward quads (Q, 4) around the negative nodes of a grid (nx, ny, nz)."""
    cells = _cell_values(values)
    inside = cells < 0
    crossed = inside.any(axis=-1) & ~inside.all(axis=-1)
    corner = cells[crossed]
    total, count = np.zeros((len(corner), 3)), np.zeros((len(corner), 1))
    for a, b in _EDGES:
        cuts = (corner[:, a] < 0) != (corner[:, b] < 0)
        t = corner[:, a] / np.where(cuts, corner[:, a] - corner[:, b], 1)
        point = _CORNERS[a] + t[:, None] * (_CORNERS[b] - _CORNERS[a])
        total += cuts[:, None] * point
        count += cuts[:, None]
    vertices = np.argwhere(crossed) + total / count
    index = np.full(crossed.shape, -1, dtype=np.int64)
    index[crossed] = np.arange(len(corner))
    return vertices, np.concatenate([_quads_across(values < 0, index, axis) for axis in range(3)])


def _quads_across(inside: Mask, index: Index, axis: int) -> Index:
    """Quads (Q, 4) of the four cells around every crossed grid edge along `axis`."""
    inside, index = np.moveaxis(inside, axis, 0), np.moveaxis(index, axis, 0)
    start, end = inside[:-1, 1:-1, 1:-1], inside[1:, 1:-1, 1:-1]
    around = [index[:, :-1, :-1], index[:, 1:, :-1], index[:, 1:, 1:], index[:, :-1, 1:]]
    # moveaxis keeps the order of the other two axes: around y they turn the other way.
    outward = start if axis != 1 else end
    quads = np.stack(around, axis=-1)
    crossed = start != end
    forward = crossed & outward
    return np.concatenate([quads[forward], quads[crossed & ~outward][:, ::-1]])


def _cell_values(values: Array) -> Array:
    """(nx - 1, ny - 1, nz - 1, 8) values at the corners of every cell."""
    nx, ny, nz = values.shape
    return np.stack([values[i : nx - 1 + i, j : ny - 1 + j, k : nz - 1 + k] for i, j, k in _CORNERS], axis=-1)


def without_double_sheets(values: Array) -> Array:
    """The grid with the corners of every ambiguous cell pushed inside until no cell holds two sheets."""
    values, bits = values.copy(), 1 << np.arange(8)
    while True:
        double = _AMBIGUOUS[(_cell_values(values) < 0) @ bits]
        if not double.any():
            return values
        nodes = (np.argwhere(double)[:, None] + _CORNERS).reshape(-1, 3)
        i, j, k = np.unique(nodes, axis=0).T
        values[i, j, k] = np.where(values[i, j, k] < 0, values[i, j, k], -1e-3 * np.abs(values).mean())


def _ambiguous() -> Mask:
    """(256,) whether a cell's inside or outside corners, one bit each, fall into pieces or a face is a checkerboard."""
    table = np.zeros(256, dtype=np.bool_)
    faces = [[c for c in range(8) if _CORNERS[c, axis] == side] for axis in range(3) for side in (0, 1)]
    for code in range(256):
        inside = [bool(code >> c & 1) for c in range(8)]
        pieces = list(range(8))
        for a, b in _EDGES:
            if inside[a] == inside[b]:
                old, new = pieces[a], pieces[b]
                pieces = [new if piece == old else piece for piece in pieces]
        checkered = any(inside[a] == inside[d] != inside[b] == inside[c] for a, b, c, d in faces)
        table[code] = len(set(pieces)) > 2 or checkered
    return table


_AMBIGUOUS = _ambiguous()


def _triangles(vertices: Array, quads: Index) -> Faces:
    """Quads (Q, 4) cut along their shorter diagonal."""
    a, b, c, d = quads.T
    first = np.linalg.norm(vertices[a] - vertices[c], axis=-1) <= np.linalg.norm(vertices[b] - vertices[d], axis=-1)
    one = np.where(first[:, None], np.stack([a, b, c], -1), np.stack([a, b, d], -1))
    two = np.where(first[:, None], np.stack([a, c, d], -1), np.stack([b, c, d], -1))
    return np.concatenate([one, two])


def neighbour_average(faces: Faces, count: int) -> csr_array:
    """Sparse (V, V): each row takes the mean over a vertex's neighbours."""
    rows = np.concatenate([faces[:, [0, 1, 2]].ravel(), faces[:, [1, 2, 0]].ravel()])
    columns = np.concatenate([faces[:, [1, 2, 0]].ravel(), faces[:, [0, 1, 2]].ravel()])
    links = csr_array((np.ones(len(rows)), (rows, columns)), shape=(count, count))
    links.data[:] = 1.0
    return csr_array(links.multiply(1 / links.sum(axis=1)[:, None]))


def _relax(vertices: Array, faces: Faces) -> Array:
    """Each vertex moved halfway towards the middle of its neighbours; projection undoes the inward part."""
    return 0.5 * (vertices + neighbour_average(faces, len(vertices)) @ vertices)


def _project(field: Field, vertices: Array, step: float) -> Array:
    """One Newton step along the gradient onto the surface, never further than ten steps."""
    value = field(vertices)
    # Four tetrahedral offsets give the gradient.
    offsets = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)], dtype=np.float64)
    gradient = sum(offset * field(vertices + step * offset)[:, None] for offset in offsets) / (4 * step)
    move = -value[:, None] * gradient / np.maximum(np.sum(gradient**2, axis=-1, keepdims=True), 0.1)
    length = np.linalg.norm(move, axis=-1, keepdims=True)
    return vertices + move * np.minimum(1, 10 * step / np.maximum(length, 1e-12))
