"""The page's headline and sentences."""

from typing import Any

from depthtrack.evaluation.compare.results import TrackerResult
from depthtrack.report.narrative import summary, tracker_summaries


class FixedResult(TrackerResult):
    """A result with given values."""

    def __init__(
        self, recording: str, label: str, error: float | None, ms: float = 10.0, lost: int = 0, e3d: float = 2.0
    ) -> None:
        super().__init__(recording, label, ())
        object.__setattr__(self, "_values", (error, ms, lost))
        object.__setattr__(self, "_figures", {"tracker_ms": ms, "endpoint_error_mm": error, "e3d_mm": e3d})

    _values: tuple[float | None, float, int]
    _figures: dict[str, float | None]

    source = property(lambda self: self.recording)
    frames = property(lambda self: 100)
    lost = property(lambda self: self._values[2])
    truth = property(lambda self: None if self._values[0] is None else "endpoint_error_mm")

    def figure(self, metric: str, statistic: str) -> float | None:
        return self._figures.get(metric)


def summary_text(results: list[TrackerResult], **more: Any) -> str:
    found = summary(results, **more)
    return " ".join([f"{found.headline}.", *found.sentences]).replace("\u00a0", " ")


def test_the_summary_of_a_single_tracker_has_its_error_and_time() -> None:
    assert summary_text([FixedResult("a", "PSO", 3.21)]) == (
        "PSO has a mean endpoint error of 3.2 mm. It takes 10.0 ms a frame. The hand was never lost."
    )


def test_the_headline_names_the_trackers_that_fit_the_rendered_model() -> None:
    results: list[TrackerResult] = [FixedResult("a", "PSO", 3.0), FixedResult("a", "IK", 2.0)]
    assert summary_text(results, matched_model=("IK",)).startswith(
        "IK is more accurate than PSO, on a hand rendered from the model of IK."
    )
    assert summary_text(results, matched_model=("PSO",)).startswith(
        "IK is more accurate than PSO, on a hand rendered from the model of PSO."
    )
    results.append(FixedResult("b", "PSO", 1.0))
    assert summary_text(results, matched_model=("IK",)).startswith(
        "Neither tracker is the most accurate on every recording, on a hand rendered from the model of IK."
    )
    assert "rendered" not in summary_text(results)


def test_equal_errors_have_no_winner() -> None:
    text = summary_text([FixedResult("a", "PSO", 3.0), FixedResult("a", "IK", 3.1, ms=10.2)])
    assert text.startswith("PSO and IK are equally accurate.")
    assert "They take the same time a frame: PSO 10.0 ms and IK 10.2 ms." in text


def test_the_summary_of_many_trackers_with_a_time_budget() -> None:
    results: list[TrackerResult] = [
        FixedResult("a", "A", 3.0, lost=2),
        FixedResult("a", "B", 0.5, ms=9),
        FixedResult("a", "C", 7.0, lost=1),
    ]
    assert summary_text(results, equal_ms=10) == (
        "B is the most accurate of three trackers. B's mean endpoint error is 0.50 mm, A's 3.0 mm and "
        "C's 7.0 mm. The time budget was 10 ms a frame; measured: B 9.0 ms, A 10.0 ms and C 10.0 ms. "
        "The hand was lost by A in 2 of 100 frames and C in 1 of 100 frames; never by B."
    )


def test_the_summary_names_the_winner_of_each_recording() -> None:
    results: list[TrackerResult] = [
        FixedResult("a", "A", 3.0),
        FixedResult("a", "B", 4.0),
        FixedResult("b", "A", 9.0),
        FixedResult("b", "B", 1.0),
    ]
    assert summary_text(results).startswith(
        "Neither tracker is the most accurate on every recording. The most accurate are A on a (3.0 mm mean endpoint "
        "error; B 4.0 mm) and B on b (1.0 mm mean endpoint error; A 9.0 mm)."
    )
    many: list[TrackerResult] = [
        FixedResult(str(k), label, 1.0 + (k % 3 == 0) * s) for k in range(6) for label, s in (("A", 1), ("B", 2))
    ]
    many += [FixedResult("6", "A", 5.0), FixedResult("6", "B", 1.0)]
    assert "Of 7 recordings, the most accurate is A on 6 and B on 1." in summary_text(many)


def test_recordings_without_ground_truth_are_excluded_from_errors() -> None:
    results: list[TrackerResult] = [
        FixedResult("a", "A", 3.0),
        FixedResult("a", "B", 4.0),
        FixedResult("b", "A", None),
        FixedResult("b", "B", None, e3d=1.0),
    ]
    text = summary_text(results)
    assert text.startswith("On recordings with ground truth, A is more accurate than B.")
    assert "Of the recordings without ground truth, the lowest E3D is that of B on 1 of 1." in text
    assert "A's mean endpoint error is 3.0 mm on the one of two recordings with ground truth, B's 4.0 mm." in text
    assert [
        round(each.error, 6) for each in tracker_summaries([FixedResult("a", "A", 3.0), FixedResult("b", "A", 5.0)])
    ] == [4.0]


def test_a_tracker_without_an_error_on_some_recording_has_an_infinite_error() -> None:
    results: list[TrackerResult] = [
        FixedResult("a", "A", 3.0),
        FixedResult("b", "A", 9.0),
        FixedResult("a", "B", 2.0),
        FixedResult("b", "B", None),
    ]
    assert [(each.label, each.error) for each in tracker_summaries(results)] == [("A", 6.0), ("B", float("inf"))]
