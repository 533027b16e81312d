"""Shared residual definitions: the compiled form equals the numpy one."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.solver.residuals import weight
from depthtrack.solver.robust import compiled_symmetric_direction, geman_mcclure, symmetric_direction


@given(seed=st.integers(0, 2**32 - 1), kernel_scale=st.floats(1e-4, 0.1))
def test_compiled_and_numpy_functions_agree(seed: int, kernel_scale: float) -> None:
    rng = np.random.default_rng(seed)
    gaps, n, m = rng.normal(0, 0.02, (5, 3)), rng.normal(size=(5, 3)), rng.normal(size=(5, 3))
    weights = geman_mcclure(np.sum(gaps**2, axis=1), kernel_scale)
    directions = np.stack(symmetric_direction(*n.T, *m.T), axis=1)
    np.testing.assert_allclose(directions * np.linalg.norm(n + m, axis=1)[:, None], n + m, atol=1e-12)
    for i in range(5):
        np.testing.assert_allclose(weight(*gaps[i], kernel_scale), weights[i], rtol=1e-12)
        np.testing.assert_allclose(compiled_symmetric_direction(*n[i], *m[i]), directions[i], atol=1e-15)
