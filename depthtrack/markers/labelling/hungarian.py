"""The Hungarian method, compiled: assignment of least cost by augmenting paths.

Sources: Kuhn, "The Hungarian method for the assignment problem", 1955; Crouse, "On implementing 2D rectangular
assignment algorithms", IEEE Trans. Aerospace and Electronic Systems 52(4), 2016.
"""

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.types import Array, Index


@compiled(nogil=True)
def assign_rows(cost: Array, rows: int, columns: int, column_of: Index) -> None:
    """Write the column of each row in the assignment of least total cost (Maycock 2015, Eq. 3).

    cost: its first `rows` and `columns` are used; finite, rows <= columns.
    column_of: (at least rows,) output.
    """
    u, v = np.zeros(rows), np.zeros(columns)
    row_of = np.full(columns, -1, np.int64)
    path, shortest, scanned = np.empty(columns, np.int64), np.empty(columns), np.empty(columns, np.bool_)
    for start in range(rows):
        column_of[start] = -1
    for start in range(rows):
        shortest[:], scanned[:] = np.inf, False
        row, reached, sink = start, 0.0, -1
        while sink < 0:
            lowest, nearest = np.inf, -1
            for j in range(columns):
                if scanned[j]:
                    continue
                length = reached + cost[row, j] - u[row] - v[j]
                if length < shortest[j]:
                    shortest[j], path[j] = length, row
                if shortest[j] < lowest or (shortest[j] == lowest and row_of[j] < 0):
                    lowest, nearest = shortest[j], j
            reached = lowest
            scanned[nearest] = True
            if row_of[nearest] < 0:
                sink = nearest
            else:
                row = row_of[nearest]
        # Potentials of the rows and columns on the path's tree.
        u[start] += reached
        for j in range(columns):
            if scanned[j]:
                if row_of[j] >= 0:
                    u[row_of[j]] += reached - shortest[j]
                v[j] -= reached - shortest[j]
        column = sink
        while True:
            row = path[column]
            row_of[column] = row
            column_of[row], column = column, column_of[row]
            if row == start:
                break
