"""The compiled sums of a view's normal equations."""

import numpy as np

from depthtrack.calibration.residuals import weighted_sums


def test_weighted_sums_are_those_of_matrix_products() -> None:
    random = np.random.default_rng(0)
    a, weights, errors = random.normal(size=(200, 61)), random.random(200), random.normal(size=200)
    a[:, 7] = 0.0
    H, g = weighted_sums(a, weights, errors)
    np.testing.assert_allclose(H, (a * weights[:, None]).T @ a, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(g, a.T @ (weights * errors), rtol=1e-12, atol=1e-12)
