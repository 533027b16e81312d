"""The animation of the page."""

import pytest

from depthtrack.evaluation.compare.results import tracker_results
from depthtrack.evaluation.evaluate import Evaluation
from depthtrack.report import animation
from depthtrack.report.animation import make_animation
from depthtrack.report.pictures import SideBySide
from depthtrack.report.series import TrackerSeries


def test_the_size_of_an_animation_is_bounded(evaluations: list[Evaluation], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(animation, "FEWEST_IMAGES", 2)
    monkeypatch.setattr(animation, "HIGHEST_RATE", 1000.0)
    series = [TrackerSeries(result, number) for number, result in enumerate(tracker_results(evaluations))]
    painter = SideBySide(series, "endpoint_error_mm", height=60)
    whole = make_animation(painter, 10_000_000)
    frames = len(evaluations[0].run.index)
    assert len(whole.images) == frames
    size = sum(map(len, whole.images))
    half = make_animation(painter, size // 2)
    assert 2 <= len(half.images) <= frames // 2 + 1
    assert sum(map(len, half.images)) < 0.65 * size
