"""Distances to the outline of a silhouette, compared with a search over all pixels."""

import numpy as np

from depthtrack.calibration.residuals import _beyond


def test_distances_to_the_outline_are_exact() -> None:
    rng = np.random.default_rng(0)
    for height, width in ((40, 31), (17, 60), (33, 33)):
        mask = np.zeros((height, width), np.bool_)
        mask[height // 4 : -height // 4, width // 4 : -width // 4] = True
        mask ^= rng.random(mask.shape) < 0.02
        row, column = np.indices(mask.shape)

        def nearest(part: np.ndarray, row: np.ndarray = row, column: np.ndarray = column) -> np.ndarray:
            v, u = np.nonzero(part)
            square = (row[..., None] - v) ** 2 + (column[..., None] - u) ** 2
            return np.asarray(np.sqrt(square.min(axis=-1).astype(np.float64)))

        assert np.array_equal(_beyond(mask), np.where(mask, 0.5 - nearest(~mask), nearest(mask) - 0.5))
