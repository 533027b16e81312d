"""Rounds of ICP in one kernel, compared with the same rounds one by one."""

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from depthtrack.hand.pose import retract
from depthtrack.hand.shape import HandShape
from depthtrack.solver.icp import IcpFitter
from depthtrack.solver.options import IcpOptions, Residual
from depthtrack.synthesis.generate import Synthesis, Synthesiser
from depthtrack.tracking.surfaces.registry import make_surface
from tests.support.observations import observe


@pytest.mark.parametrize("residual", get_args(Residual))
@pytest.mark.parametrize("coarse", [False, True])
def test_rounds_in_one_kernel_equal_rounds_one_by_one(
    monkeypatch: pytest.MonkeyPatch, residual: Residual, coarse: bool
) -> None:
    made = Synthesiser(Synthesis(model="skin", frames=4))
    surface = make_surface("skin", HandShape())
    fitter = IcpFitter(HandShape(), surface, replace(IcpOptions(), residual=residual))
    fitter.set_target(observe(made, 2), every=3)
    start = retract(made[2].pose, np.random.default_rng(0).normal(0, 0.05, 26))
    pose, solution = fitter.fit(start, coarse=coarse), fitter.solution
    monkeypatch.setattr(surface, "search", lambda cloud: None)
    again, other = fitter.fit(start, coarse=coarse), fitter.solution
    assert solution is not None
    assert other is not None
    np.testing.assert_array_equal(pose, again)
    np.testing.assert_array_equal(solution.trace, other.trace)
    assert (solution.status, solution.iterations) == (other.status, other.iterations)
    assert np.abs(pose - start).max() > 1e-3
