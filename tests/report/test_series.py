"""Curves over time, success curves and the choice of the worst frames."""

import numpy as np
import pytest

from depthtrack.evaluation.compare.results import tracker_results
from depthtrack.evaluation.evaluate import Evaluation
from depthtrack.report.series import axis_limit, metric_curve, success_curve, worst_frames


def test_metric_curves_have_the_range_of_the_runs(evaluations: list[Evaluation]) -> None:
    near = next(result for result in tracker_results(evaluations) if result.label == "Near")
    curve = metric_curve(near, "endpoint_error_mm")
    np.testing.assert_allclose(curve.low, 2, atol=1e-6)
    np.testing.assert_allclose(curve.median, 3, atol=1e-6)
    np.testing.assert_allclose(curve.high, 4, atol=1e-6)
    assert curve.seconds[0] == 0
    assert curve.frames_per_point == 1


def test_metric_curves_of_long_recordings_keep_peaks(
    evaluations: list[Evaluation], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("depthtrack.report.series.POINTS", 3)
    far = next(result for result in tracker_results(evaluations) if result.label.startswith("Far"))
    curve = metric_curve(far, "endpoint_error_mm")
    assert len(curve.seconds) == 3
    assert curve.frames_per_point == 3
    np.testing.assert_allclose(curve.median, [9, 20, 9], atol=1e-6)


def test_success_curves_include_all_runs(evaluations: list[Evaluation]) -> None:
    near = next(result for result in tracker_results(evaluations) if result.label == "Near")
    found = success_curve(near)
    assert found is not None
    thresholds, share = found
    assert share[np.searchsorted(thresholds, 1.5)] == 0
    assert share[np.searchsorted(thresholds, 3.0)] == 0.5
    assert share[np.searchsorted(thresholds, 5.0)] == 1


def test_worst_frames_are_spaced_in_time() -> None:
    values = np.array([1.0, 9.0, 8.0, 2.0, 7.0, np.nan, 3.0])
    assert worst_frames(values, 0.3 * np.arange(7, dtype=np.float64), count=3, spacing=0.5) == [1, 4, 6]
    assert worst_frames(np.full(3, np.nan), np.arange(3.0), count=2) == []


def test_the_axis_limit_of_smooth_curves_is_above_their_maximum(evaluations: list[Evaluation]) -> None:
    near = next(result for result in tracker_results(evaluations) if result.label == "Near")
    np.testing.assert_allclose(axis_limit([metric_curve(near, "endpoint_error_mm")]), (4.4, 4))
    assert axis_limit([]) == (1.0, 0.0)
