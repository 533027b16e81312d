"""The report page: its text matches the runs, it is self-contained, and its size is bounded."""

import json
import re
import shutil
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from depthtrack.cli import main
from depthtrack.errors import InputError
from depthtrack.evaluation.compare.results import TrackerResult, tracker_results
from depthtrack.evaluation.evaluate import Evaluation, evaluate_run
from depthtrack.recording import open_sequence
from depthtrack.report import animation
from depthtrack.report.animation import make_animation
from depthtrack.report.build import write_report
from depthtrack.report.narrative import summary, tracker_summaries
from depthtrack.report.pictures import SideBySide
from depthtrack.report.provenance import bias_warning, matched_model
from depthtrack.report.series import TrackerSeries, axis_limit, metric_curve, success_curve, worst_frames
from tests.support.runs import synthesise, true_poses, write_run

FRAMES = 8


def shifted(poses: np.ndarray, mm: float, frames: slice = slice(None)) -> np.ndarray:
    """Return poses whose endpoint errors are exactly `mm`."""
    out = poses.copy()
    out[frames, 0] += mm / 1000
    return out


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return synthesise(tmp_path_factory.mktemp("made") / "everyday", FRAMES)


@pytest.fixture(scope="module")
def runs(recording: Path, tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Write runs Near (two seeds, errors 2 and 4 mm) and Far (9 mm; 20 mm in one lost frame)."""
    folder, poses = tmp_path_factory.mktemp("runs"), true_poses(recording)
    far = shifted(shifted(poses, 9), 11, slice(5, 6))
    return [
        write_run(folder / "far_0", recording, far, {5: "lost"}, label="Far <b>", seed=0),
        write_run(folder / "near_0", recording, shifted(poses, 2), label="Near", seed=0, clock="cpu"),
        write_run(folder / "near_1", recording, shifted(poses, 4), label="Near", seed=1, clock="cpu"),
    ]


@pytest.fixture(scope="module")
def evaluations(runs: list[Path]) -> list[Evaluation]:
    return [evaluate_run(run) for run in runs]


@pytest.fixture(scope="module")
def page(evaluations: list[Evaluation], tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("page") / "report.html"
    write_report(evaluations, path)
    return path.read_text(encoding="utf-8")


class Reader(HTMLParser):
    """Parser of a page's text, links and nesting."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.text, self.links, self.open = "", list[str](), list[str]()
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.links += [value or "" for name, value in attrs if name in ("src", "href", "xlink:href")]
        if tag not in ("meta", "img", "input", "link", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] not in ("style", "script"):
            self.text += f"{data.strip()} " if data.strip() else ""


def test_the_page_states_the_more_accurate_tracker_and_the_errors(page: str) -> None:
    text = Reader(page).text.replace("\u00a0", " ")
    assert "Near is more accurate than Far <b>" in text
    # The median of the runs' means, 2 and 4 mm; and (7 * 9 + 20) / 8.
    assert "Near's mean endpoint error is 3.0 mm, Far <b>'s 10.4 mm." in text
    assert "The hand was lost by Far <b> in 1 of 8 frames; never by Near." in text
    assert "frame 5, 20.0 mm" in text
    assert "Biased comparison" not in text


def test_the_page_is_well_formed_and_self_contained(page: str) -> None:
    reader = Reader(page)
    assert reader.open == []
    assert reader.links
    assert all(link.startswith(("data:image/", "#")) for link in reader.links)
    assert "default-src 'none'" in page
    assert "://" not in re.sub(r"data:image/\S+|http://www.w3.org/\S+", "", page)
    # Labels are escaped, and no placeholder of a colour remains.
    assert "Far <b>" not in page
    assert not re.search(r"#0[1-5]0[0-9a-f]0[1-5]", page)
    assert "var(--tracker-1)" in page


def test_the_animation_has_images_in_the_order_of_the_recording(page: str, recording: Path) -> None:
    found = re.search(r'<script type="application/json" class="animation">(.*?)</script>', page, re.DOTALL)
    assert found is not None
    animation = json.loads(found[1])
    assert len(animation["images"]) == len(animation["seconds"])
    times = open_sequence(recording).timestamps
    assert set(np.round(animation["seconds"], 3)) <= set(np.round(times - times[0], 3))
    assert animation["seconds"] == sorted(animation["seconds"])


def test_the_page_does_not_depend_on_the_order_of_the_runs(
    runs: list[Path], page: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["evaluate", *map(str, reversed(runs)), "--report", str(tmp_path / "again")]) == 0
    assert str(tmp_path / "again" / "report.html") in capsys.readouterr().out
    assert (tmp_path / "again" / "report.html").read_text(encoding="utf-8") == page
    assert len(json.loads((tmp_path / "again" / "results.json").read_text())) == 3


def test_json_output_is_unchanged_by_a_report(
    runs: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["evaluate", str(runs[0]), "--json", "--report", str(tmp_path)]) == 0
    assert json.loads(capsys.readouterr().out)["frames"] == FRAMES
    assert (tmp_path / "report.html").exists()


def test_without_ground_truth_the_page_uses_label_free_metrics(recording: Path, tmp_path: Path) -> None:
    poses, blind = true_poses(recording), tmp_path / "blind"
    shutil.copytree(recording, blind)
    for file in ("hand_poses.csv", "joints.csv"):
        (blind / file).unlink()
    good = write_run(tmp_path / "good", blind, poses, label="Good")
    bad = write_run(tmp_path / "bad", blind, shifted(poses, 15), label="Bad")
    write_report([evaluate_run(good), evaluate_run(bad)], tmp_path / "report.html")
    text = Reader((tmp_path / "report.html").read_text()).text
    assert "Good is more accurate than Bad" in text
    assert "median E3D" in text
    assert "Silhouette IoU" in text
    assert "Error of each finger" not in text


def test_a_run_without_a_found_hand_gives_a_page(recording: Path, tmp_path: Path) -> None:
    poses = true_poses(recording)
    absent = write_run(tmp_path / "absent", recording, poses[:3], dict.fromkeys(range(3), "absent"))
    write_report([evaluate_run(absent)], tmp_path / "report.html")
    assert "No tracker found the hand" in Reader((tmp_path / "report.html").read_text()).text


def test_runs_without_frames_raise_an_input_error(recording: Path, tmp_path: Path) -> None:
    empty = write_run(tmp_path / "empty", recording, true_poses(recording)[:0])
    with pytest.raises(InputError, match="holds no frame"):
        write_report([evaluate_run(empty)], tmp_path / "report.html")
    assert main(["evaluate", str(empty), "--report", str(tmp_path / "report")]) == 2
    assert not (tmp_path / "report").exists()
    with pytest.raises(InputError, match="at least one run"):
        write_report([], tmp_path / "report.html")


def test_the_size_of_an_animation_is_bounded(evaluations: list[Evaluation], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(animation, "FEWEST_IMAGES", 2)
    monkeypatch.setattr(animation, "HIGHEST_RATE", 1000.0)
    series = [TrackerSeries(result, number) for number, result in enumerate(tracker_results(evaluations))]
    painter = SideBySide(series, "endpoint_error_mm", height=60)
    whole = make_animation(painter, 10_000_000)
    assert len(whole.images) == FRAMES
    size = sum(map(len, whole.images))
    half = make_animation(painter, size // 2)
    assert 2 <= len(half.images) <= FRAMES // 2 + 1
    assert sum(map(len, half.images)) < 0.65 * size


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


def test_runs_without_labels_are_named_by_their_options(recording: Path, tmp_path: Path) -> None:
    """Runs are named by options that differ from the defaults, else by their folders."""
    poses = true_poses(recording)
    more: dict[str, Any] = {"variant": "default", "particles": 64, "seed": 0}
    runs = [
        write_run(tmp_path / "usual", recording, poses, **more),
        write_run(tmp_path / "paper", recording, poses, **more | {"variant": "paper"}),
        write_run(tmp_path / "again", recording, poses, **more | {"variant": "paper", "seed": 1}),
        write_run(tmp_path / "ik_a", recording, poses, tracker="ik", seed=0),
        write_run(tmp_path / "ik_b", recording, poses, tracker="ik", seed=0),
    ]
    results = tracker_results([evaluate_run(run, residuals=False) for run in runs])
    assert [(result.label, len(result.evaluations)) for result in results] == [
        ("PSO", 1),
        ("OIKONOMIDIS2011", 2),
        ("IK, ik_a", 1),
        ("IK, ik_b", 1),
    ]


def test_the_page_warns_of_a_comparison_that_favours_a_tracker(
    evaluations: list[Evaluation], recording: Path, tmp_path: Path
) -> None:
    skin = write_run(tmp_path / "skin", recording, true_poses(recording), tracker="ik", model="skin", label="Skin")
    compared = [*evaluations[:2], evaluate_run(skin, residuals=False)]
    results = tracker_results(compared)
    warning = bias_warning({"model": "skin"}, results)
    assert warning.startswith("Biased comparison")
    assert "that Skin fits and Far <b> and Near do not" in warning
    assert "that Far <b> and Near fit and Skin does not" in bias_warning({"model": "primitives"}, results)
    assert bias_warning({"sensor": "kinect1"}, results) == ""
    assert matched_model({"model": "skin"}, results) == ("Skin",)
    write_report(compared, tmp_path / "report.html")
    text = Reader((tmp_path / "report.html").read_text(encoding="utf-8")).text
    assert "Skin is the most accurate of three trackers, on a hand rendered from the model of Far <b> and Near" in text
    assert matched_model({"model": "skin"}, results[:1]) == ()
