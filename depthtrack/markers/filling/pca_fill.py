"""Baseline: principal components of the whole marker set.

Sources:
- Gloersen and Federolf, "Predicting missing marker trajectories in human motion data using marker intercorrelations",
  PLoS ONE 11(3), 2016.
- Federolf, "A novel approach to solve the missing marker problem", PLoS ONE 8(10), 2013.

Each gap is filled by itself. A marker with gaps elsewhere is used, and the paper's removal of distal markers with gaps
is not needed.
"""

import numpy as np

from depthtrack.markers.filled_capture import Gap, measured_samples
from depthtrack.markers.filling.options import PcaFillOptions
from depthtrack.types import Array, Index, Mask

_FRAMES = 3
"""Fewest complete frames to learn from."""


def pca_fill(measured: Array, gaps: list[Gap], options: PcaFillOptions) -> Array:
    """Return the positions (T, M, 3) of the markers in the gaps, NaN elsewhere.

    measured: (T, M, 3) metres, all markers of the capture; NaN if not measured.
    gaps: with `marker` as a column of `measured`.

    Strategy R1 reconstructs all markers that are missing during the gap at once; R2 reconstructs the one marker, and
    leaves out the others that are missing.
    """
    visible = measured_samples(measured)
    distances = mean_distances(measured)
    filled = np.full(measured.shape, np.nan)
    for gap in gaps:
        frames = np.arange(gap.start, gap.stop)
        present = np.asarray(visible[frames].all(axis=0))
        used = np.array(visible.any(axis=0) if options.strategy == "R1" else present)
        used[gap.marker] = True
        columns = np.flatnonzero(used)
        missing = np.asarray(~present[columns])
        training = np.asarray(visible[:, columns].all(axis=1))
        if missing.all() or training.sum() < _FRAMES:
            continue
        weights = _weights(distances[np.ix_(columns[missing], columns)], missing, options)
        rebuilt = _reconstructed(measured[:, columns], training, frames, missing, weights, options)
        filled[frames, gap.marker] = rebuilt[:, np.flatnonzero(columns == gap.marker)[0]]
    return filled


def _weights(distances: Array, missing: Mask, options: PcaFillOptions) -> Array:
    """Return the weight (M,) of each marker: it falls with the distance from a missing one.

    distances: (K, M) metres, mean distance of the K missing markers from all.
    """
    nearest = np.nan_to_num(np.nanmin(distances, axis=0), nan=np.inf)
    weights = np.exp(-(nearest**2) / (2 * options.weight_scale**2))
    return np.where(missing, options.missing_weight, np.maximum(weights, 1e-9))


def _reconstructed(
    measured: Array, training: Mask, frames: Index, missing: Mask, weights: Array, options: PcaFillOptions
) -> Array:
    """Return the positions (n, M, 3) of the frames, metres, from the markers present."""
    centre = measured[:, ~missing].mean(axis=1, keepdims=True)
    moving = measured - centre
    N = moving[training]
    mean, spread = N.mean(axis=0), N.std(axis=0)
    scale = weights[:, None] / np.where(spread > 0, spread, 1.0)
    complete = ((N - mean) * scale).reshape(len(N), -1)
    zeroed = (np.where(missing[:, None], 0.0, N - mean) * scale).reshape(len(N), -1)
    given = (np.where(missing[:, None], 0.0, moving[frames] - mean) * scale).reshape(len(frames), -1)
    (values, C), (other_values, Z) = _components(complete), _components(zeroed)
    count = max(_kept(values, options.variance_share), _kept(other_values, options.variance_share))
    C, Z = C[:, :count], Z[:, :count]
    # Federolf 2013, Eq. (1): scores of the incomplete basis, turned to the complete one.
    rebuilt = given @ Z @ (Z.T @ C) @ C.T
    return np.asarray(rebuilt.reshape(len(frames), -1, 3) / scale + mean + centre[frames])


def _components(X: Array) -> tuple[Array, Array]:
    """Return singular values (K,) and right singular vectors (N, K), descending."""
    _, values, Vt = np.linalg.svd(np.linalg.qr(X, mode="r"))
    return values, Vt.T


def _kept(values: Array, share: float) -> int:
    return int(np.searchsorted(np.cumsum(values), share * values.sum())) + 1


def mean_distances(measured: Array) -> Array:
    """Return the mean distance (M, M) of markers from each other, metres."""
    count = measured.shape[1]
    distances = np.full((count, count), np.nan)
    for m in range(count):
        apart = np.linalg.norm(measured - measured[:, m : m + 1], axis=-1)
        seen = np.isfinite(apart).any(axis=0)
        distances[m, seen] = np.nanmean(apart[:, seen], axis=0)
    return distances
