"""The compiled Hungarian method against scipy's."""

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from depthtrack.markers.labelling.hungarian import assign_rows


@pytest.mark.parametrize("seed", range(30))
def test_the_assignment_has_the_least_cost(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = int(rng.integers(1, 12))
    columns = rows + int(rng.integers(0, 6))
    cost = rng.uniform(-1, 1, (rows, columns)).round(int(rng.integers(1, 8)))
    chosen = np.empty(rows, np.int64)
    assign_rows(cost, rows, columns, chosen)
    assert len(set(chosen)) == rows
    assert cost[np.arange(rows), chosen].sum() == pytest.approx(cost[linear_sum_assignment(cost)].sum())


def test_only_the_stated_part_of_the_matrix_is_read() -> None:
    cost = np.full((5, 6), np.nan)
    cost[:2, :3] = [[1.0, 2.0, 9.0], [1.0, 3.0, 9.0]]
    chosen = np.full(5, -7, np.int64)
    assign_rows(cost, 2, 3, chosen)
    assert chosen.tolist() == [1, 0, -7, -7, -7]
