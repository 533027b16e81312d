"""Assignment of the points of a frame to the expected markers.

It maximises likelihood ratios, or minimises padded distances (Maycock et al. 2015, Eq. 3).
"""

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.markers.labelling.hungarian import assign_rows
from depthtrack.markers.labelling.prediction import mahalanobis
from depthtrack.markers.labelling.scene import Scene
from depthtrack.markers.labelling.state import FrameLabels, Settings, TrackState
from depthtrack.types import Array

PADDING = 1e3
"""Distance to the points that pad the matrix of Eq. (3), metres: larger than any sum of real ones."""


@compiled(nogil=True)
def assign(points: Array, scene: Scene, settings: Settings, state: TrackState, out: FrameLabels) -> None:
    """Write the point of each marker of the active models to `out`."""
    out.point[:] = -1
    out.score[:] = np.nan
    out.margin[:] = np.nan
    if points.shape[0] == 0:
        return
    if settings.padded:
        _assign_padded(points, scene, settings, state, out)
    else:
        _assign_likely(points, scene, settings, state, out)


@compiled(nogil=True)
def _assign_padded(points: Array, scene: Scene, settings: Settings, state: TrackState, out: FrameLabels) -> None:
    """Minimise the sum of distances (Eq. 3), then drop points beyond the mean error plus a term."""
    M, K = out.point.shape[0], points.shape[0]
    rows, model = np.empty(M, np.int64), np.empty(M, np.int64)
    count = 0
    for g in range(scene.rigid.shape[0]):
        if state.active[g]:
            for i in range(scene.first[g], scene.first[g + 1]):
                rows[count], model[count] = i, g
                count += 1
    cost = np.full((count, K + count), PADDING)
    for n in range(count):
        p = out.expected[rows[n]]
        for j in range(K):
            x, y, z = points[j, 0] - p[0], points[j, 1] - p[1], points[j, 2] - p[2]
            cost[n, j] = np.sqrt(x * x + y * y + z * z)
    chosen = np.empty(count, np.int64)
    assign_rows(cost, count, K + count, chosen)
    for n in range(count):
        i, j, largest = rows[n], chosen[n], state.error[model[n]] + settings.distance_term
        if j < K and cost[n, j] < largest:
            out.point[i] = j
            out.score[i] = largest - cost[n, j]
            out.margin[i] = out.score[i]


@compiled(nogil=True)
def _assign_likely(points: Array, scene: Scene, settings: Settings, state: TrackState, out: FrameLabels) -> None:
    """Maximise the sum of log-likelihood ratios of labels against none.

    The ratio is the density of the point about the expected place over the density of points without a marker. It is
    multiplied by the odds that the marker is visible. Labels with a ratio below 1 are not made. Pairs that compete with
    no other need no Hungarian method.
    """
    M, K = out.point.shape[0], points.shape[0]
    score = np.full((M, K), -np.inf)
    in_row, in_column, only = np.zeros(M, np.int64), np.zeros(K, np.int64), np.full(M, -1, np.int64)
    for g in range(scene.rigid.shape[0]):
        if not state.active[g]:
            continue
        for i in range(scene.first[g], scene.first[g + 1]):
            odds = settings.seen_again if state.missing[i] == 0 else settings.reappears
            best = odds - settings.clutter + out.peak[i]
            for j in range(K):
                value = best - 0.5 * mahalanobis(out.precision[i], out.expected[i], points[j])
                if value > 0:
                    score[i, j] = value
                    in_row[i] += 1
                    in_column[j] += 1
                    only[i] = j
    rows, columns = np.empty(M, np.int64), np.empty(K, np.int64)
    competing, wanted = 0, np.zeros(K, np.bool_)
    for i in range(M):
        if in_row[i] == 1 and in_column[only[i]] == 1:
            out.point[i] = only[i]
        elif in_row[i] > 0:
            rows[competing] = i
            competing += 1
            for j in range(K):
                wanted[j] |= score[i, j] > 0
    if competing > 0:
        width = 0
        for j in range(K):
            if wanted[j]:
                columns[width] = j
                width += 1
        cost = np.zeros((competing, width + competing))
        for n in range(competing):
            for c in range(width):
                value = score[rows[n], columns[c]]
                cost[n, c] = -value if value > 0 else PADDING
        chosen = np.empty(competing, np.int64)
        assign_rows(cost, competing, width + competing, chosen)
        for n in range(competing):
            if chosen[n] < width:
                out.point[rows[n]] = columns[chosen[n]]
    for i in range(M):
        j = out.point[i]
        if j < 0:
            continue
        out.score[i] = score[i, j]
        other = 0.0
        for k in range(K):
            if k != j:
                other = max(other, score[i, k])
        for k in range(M):
            if k != i and score[k, j] > 0:
                held = 0.0 if out.point[k] < 0 else score[k, out.point[k]]
                other = max(other, score[k, j] - held)
        out.margin[i] = score[i, j] - other
