"""Options of the solvers: the points that a fit uses, and values out of range."""

from typing import Any

import pytest

from depthtrack.errors import InputError
from depthtrack.solver.options import SurfaceFitOptions


@pytest.mark.parametrize(
    ("options", "count", "step"),
    [
        (SurfaceFitOptions(), 100_000, 3),
        (SurfaceFitOptions(subsample=1, max_points=500), 500, 1),
        (SurfaceFitOptions(subsample=1, max_points=500), 501, 2),
        (SurfaceFitOptions(subsample=3, max_points=500), 1000, 3),
        (SurfaceFitOptions(subsample=3, max_points=500), 0, 3),
    ],
)
def test_a_fit_uses_no_more_points_than_stated(options: SurfaceFitOptions, count: int, step: int) -> None:
    assert options.step(count) == step
    assert options.max_points == 0 or len(range(0, count, step)) <= options.max_points


@pytest.mark.parametrize("wrong", [{"subsample": 0}, {"subsample": 1001}, {"max_points": -1}])
def test_values_out_of_range_are_rejected(wrong: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=next(iter(wrong))):
        SurfaceFitOptions(**wrong)
