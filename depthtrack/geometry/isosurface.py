"""Closed triangle meshes of implicit solids, negative inside, by surface nets.

Source: Gibson, "Constrained elastic surface nets", MICCAI 1998. Relaxation then spreads the vertices evenly.

Surface nets put one vertex into every grid cell that the surface crosses and one quad across every grid edge that
it crosses. If two parts of the surface cross a cell, the net would touch itself. Such cells are filled first, so
that the mesh is always a closed manifold.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from depthtrack.types import Array, Faces, Index, Mask

Field = Callable[[Array], Array]
"""Signed values (N,) of points (N, 3): about the distance, metres, near the surface."""

_CORNERS = np.array([(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)])
_EDGES = [(a, b) for a in range(8) for b in range(a + 1, 8) if np.abs(_CORNERS[a] - _CORNERS[b]).sum() == 1]


def polygonise(field: Field, low: Array, high: Array, cell: float, rounds: int = 3) -> tuple[Array, Faces]:
    """Return the vertices (V, 3) and outward faces (F, 3) of the surface `field = 0` in a box.

    low, high: (3,) corners of the box, metres; it must enclose the solid with a margin of one cell.
    cell: metres.
    rounds: rounds of relaxation, which spread the vertices evenly and put them on the surface.
    """
    shape = np.ceil((high - low) / cell).astype(np.int64) + 1
    axes = [low[a] + cell * np.arange(shape[a]) for a in range(3)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    values = field(points.reshape(-1, 3)).reshape(points.shape[:3])
    vertices, quads = surface_nets(without_ambiguous_cells(values))
    vertices = low + cell * vertices
    average = neighbour_average(_triangles(vertices, quads), len(vertices))
    for _ in range(rounds):
        vertices = _project(field, 0.5 * (vertices + average @ vertices), 0.1 * cell)
    faces = _triangles(vertices, quads)
    return _project(field, vertices, 0.1 * cell), faces


def surface_nets(values: Array) -> tuple[Array, Index]:
    """Return vertices (V, 3), grid units, and outward quads (Q, 4) around the negative nodes.

    values: (nx, ny, nz), of either sign.
    """
    codes = _inside_corners(values)
    crossed = (codes > 0) & (codes < 255)
    places = np.argwhere(crossed)
    corner = values[tuple(np.moveaxis(places[:, None] + _CORNERS, -1, 0))]
    total, count = np.zeros((len(corner), 3)), np.zeros((len(corner), 1))
    for a, b in _EDGES:
        cuts = (corner[:, a] < 0) != (corner[:, b] < 0)
        t = corner[:, a] / np.where(cuts, corner[:, a] - corner[:, b], 1)
        point = _CORNERS[a] + t[:, None] * (_CORNERS[b] - _CORNERS[a])
        total += cuts[:, None] * point
        count += cuts[:, None]
    vertices = places + total / count
    index = np.full(crossed.shape, -1, dtype=np.int64)
    index[crossed] = np.arange(len(corner))
    return vertices, np.concatenate([_quads_across(values < 0, index, axis) for axis in range(3)])


def _quads_across(inside: Mask, index: Index, axis: int) -> Index:
    """Return the quads (Q, 4) of the four cells around every crossed grid edge along `axis`."""
    inside, index = np.moveaxis(inside, axis, 0), np.moveaxis(index, axis, 0)
    start, end = inside[:-1, 1:-1, 1:-1], inside[1:, 1:-1, 1:-1]
    around = [index[:, :-1, :-1], index[:, 1:, :-1], index[:, 1:, 1:], index[:, :-1, 1:]]
    # moveaxis keeps the order of the other two axes: around y they turn the other way.
    outward = start if axis != 1 else end
    quads = np.stack(around, axis=-1)
    crossed = start != end
    forward = crossed & outward
    return np.concatenate([quads[forward], quads[crossed & ~outward][:, ::-1]])


def _inside_corners(values: Array) -> NDArray[np.uint8]:
    """Return the negative corners of each cell (nx - 1, ny - 1, nz - 1), one bit each."""
    inside = (values < 0).astype(np.uint8)
    nx, ny, nz = values.shape
    codes = np.zeros((nx - 1, ny - 1, nz - 1), np.uint8)
    for bit, (i, j, k) in enumerate(_CORNERS):
        codes |= inside[i : nx - 1 + i, j : ny - 1 + j, k : nz - 1 + k] << bit
    return codes


def without_ambiguous_cells(values: Array) -> Array:
    """Return the grid with the corners of ambiguous cells made negative until none is left."""
    values = values.copy()
    while True:
        double = _AMBIGUOUS[_inside_corners(values)]
        if not double.any():
            return values
        nodes = (np.argwhere(double)[:, None] + _CORNERS).reshape(-1, 3)
        i, j, k = np.unique(nodes, axis=0).T
        values[i, j, k] = np.where(values[i, j, k] < 0, values[i, j, k], -1e-3 * np.abs(values).mean())


def _ambiguous() -> Mask:
    """Return (256,) whether a cell is ambiguous, indexed by its inside corners, one bit each.

    Its inside or outside corners are then not connected, or a face is a checkerboard.
    """
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
    """Return the triangles (2 Q, 3) of quads (Q, 4), cut along the shorter diagonal."""
    a, b, c, d = quads.T
    first = np.linalg.norm(vertices[a] - vertices[c], axis=-1) <= np.linalg.norm(vertices[b] - vertices[d], axis=-1)
    one = np.where(first[:, None], np.stack([a, b, c], -1), np.stack([a, b, d], -1))
    two = np.where(first[:, None], np.stack([a, c, d], -1), np.stack([b, c, d], -1))
    return np.concatenate([one, two])


def neighbour_average(faces: Faces, count: int) -> csr_array:
    """Return the sparse matrix (V, V) whose rows average over a vertex's neighbours."""
    rows = np.concatenate([faces[:, [0, 1, 2]].ravel(), faces[:, [1, 2, 0]].ravel()])
    columns = np.concatenate([faces[:, [1, 2, 0]].ravel(), faces[:, [0, 1, 2]].ravel()])
    links = csr_array((np.ones(len(rows)), (rows, columns)), shape=(count, count))
    links.data[:] = 1.0
    return csr_array(links.multiply(1 / links.sum(axis=1)[:, None]))


def _project(field: Field, vertices: Array, step: float) -> Array:
    """Return the vertices after a Newton step along the gradient, of at most ten `step`."""
    value = field(vertices)
    # Four tetrahedral offsets give the gradient.
    offsets = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)], dtype=np.float64)
    gradient = sum(offset * field(vertices + step * offset)[:, None] for offset in offsets) / (4 * step)
    move = -value[:, None] * gradient / np.maximum(np.sum(gradient**2, axis=-1, keepdims=True), 0.1)
    length = np.linalg.norm(move, axis=-1, keepdims=True)
    return vertices + move * np.minimum(1, 10 * step / np.maximum(length, 1e-12))
