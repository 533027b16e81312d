"""The report: what it says is what the runs hold, it needs nothing beside itself, and its size is bounded."""

import json
import re
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
from depthtrack.report import film as films
from depthtrack.report.build import write_report
from depthtrack.report.film import film_of
from depthtrack.report.narrative import standings, verdict
from depthtrack.report.pictures import SideBySide
from depthtrack.report.provenance import bias_warning, matched_model
from depthtrack.report.series import TrackerSeries, over_time, shares, top_of_scale, worst_frames
from tests.support.runs import synthesise, true_poses, write_run

FRAMES = 8


def shifted(poses: np.ndarray, mm: float, frames: slice = slice(None)) -> np.ndarray:
    """Every endpoint off by as much: the error is known."""
    out = poses.copy()
    out[frames, 0] += mm / 1000
    return out


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return synthesise(tmp_path_factory.mktemp("made") / "everyday", FRAMES)


@pytest.fixture(scope="module")
def runs(recording: Path, tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Near, with two seeds, 2 and 4 mm off; and Far: 9 mm off, 20 in one frame, which it gave up."""
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
    """Text, links and the nesting of a page."""

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


def test_the_page_says_who_is_closer_and_by_how_much(page: str) -> None:
    text = Reader(page).text.replace("\u00a0", " ")
    assert "Near follows the hand more closely than Far <b>" in text
    # The median of the runs' means, 2 and 4 mm; and (7 * 9 + 20) / 8.
    assert "Near's mean endpoint error is 3.0 mm, Far <b>'s 10.4 mm." in text
    assert "The hand was lost by Far <b> in 1 of 8 frames; never by Near." in text
    assert "frame 5, 20.0 mm" in text
    assert "Home ground" not in text


def test_the_page_is_well_formed_and_needs_nothing_beside_itself(page: str) -> None:
    reader = Reader(page)
    assert reader.open == []
    assert reader.links
    assert all(link.startswith(("data:image/", "#")) for link in reader.links)
    assert "default-src 'none'" in page
    assert "://" not in re.sub(r"data:image/\S+|http://www.w3.org/\S+", "", page)
    # A label is text, whatever it holds, and no plot keeps a stand-in for a colour.
    assert "Far <b>" not in page
    assert not re.search(r"#0[1-5]0[0-9a-f]0[1-5]", page)
    assert "var(--tracker-1)" in page


def test_the_film_shows_every_moment_of_a_short_recording(page: str, recording: Path) -> None:
    found = re.search(r'<script type="application/json" class="film">(.*?)</script>', page, re.DOTALL)
    assert found is not None
    film = json.loads(found[1])
    assert len(film["pictures"]) == len(film["seconds"])
    times = open_sequence(recording).timestamps
    assert set(np.round(film["seconds"], 3)) <= set(np.round(times - times[0], 3))
    assert film["seconds"] == sorted(film["seconds"])


def test_the_same_runs_give_the_same_page_whoever_asks(
    runs: list[Path], page: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["evaluate", *map(str, reversed(runs)), "--report", str(tmp_path / "again")]) == 0
    assert str(tmp_path / "again" / "report.html") in capsys.readouterr().out
    assert (tmp_path / "again" / "report.html").read_text(encoding="utf-8") == page
    assert len(json.loads((tmp_path / "again" / "results.json").read_text())) == 3


def test_json_stays_json_beside_a_report(runs: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["evaluate", str(runs[0]), "--json", "--report", str(tmp_path)]) == 0
    assert json.loads(capsys.readouterr().out)["frames"] == FRAMES
    assert (tmp_path / "report.html").exists()


def test_without_a_truth_label_free_metrics_stand_in(recording: Path, tmp_path: Path) -> None:
    import shutil

    poses, blind = true_poses(recording), tmp_path / "blind"
    shutil.copytree(recording, blind)
    for file in ("hand_poses.csv", "joints.csv"):
        (blind / file).unlink()
    good = write_run(tmp_path / "good", blind, poses, label="Good")
    bad = write_run(tmp_path / "bad", blind, shifted(poses, 15), label="Bad")
    write_report([evaluate_run(good), evaluate_run(bad)], tmp_path / "report.html")
    text = Reader((tmp_path / "report.html").read_text()).text
    assert "Good follows the hand more closely than Bad" in text
    assert "median E3D" in text
    assert "Agreement of silhouettes" in text
    assert "Error of each finger" not in text


def test_a_hand_that_was_never_found_still_gives_a_page(recording: Path, tmp_path: Path) -> None:
    poses = true_poses(recording)
    absent = write_run(tmp_path / "absent", recording, poses[:3], dict.fromkeys(range(3), "absent"))
    write_report([evaluate_run(absent)], tmp_path / "report.html")
    assert "No tracker followed the hand" in Reader((tmp_path / "report.html").read_text()).text


def test_runs_without_frames_are_refused(recording: Path, tmp_path: Path) -> None:
    empty = write_run(tmp_path / "empty", recording, true_poses(recording)[:0])
    with pytest.raises(InputError, match="holds no frame"):
        write_report([evaluate_run(empty)], tmp_path / "report.html")
    assert main(["evaluate", str(empty), "--report", str(tmp_path / "report")]) == 2
    assert not (tmp_path / "report").exists()
    with pytest.raises(InputError, match="at least one run"):
        write_report([], tmp_path / "report.html")


def test_a_film_keeps_within_its_bytes(evaluations: list[Evaluation], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(films, "LEAST_PICTURES", 2)
    monkeypatch.setattr(films, "FASTEST", 1000.0)
    shown = [TrackerSeries(line, number) for number, line in enumerate(tracker_results(evaluations))]
    painter = SideBySide(shown, "endpoint_error_mm", height=60)
    whole = film_of(painter, 10_000_000)
    assert len(whole.pictures) == FRAMES
    size = sum(map(len, whole.pictures))
    half = film_of(painter, size // 2)
    assert 2 <= len(half.pictures) <= FRAMES // 2 + 1
    assert sum(map(len, half.pictures)) < 0.65 * size


def test_curves_over_time_and_their_bands(evaluations: list[Evaluation]) -> None:
    near = next(line for line in tracker_results(evaluations) if line.label == "Near")
    curve = over_time(near, "endpoint_error_mm")
    np.testing.assert_allclose(curve.low, 2, atol=1e-6)
    np.testing.assert_allclose(curve.median, 3, atol=1e-6)
    np.testing.assert_allclose(curve.high, 4, atol=1e-6)
    assert curve.seconds[0] == 0
    assert curve.worst_of == 1


def test_long_recordings_keep_their_peaks(evaluations: list[Evaluation], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("depthtrack.report.series.POINTS", 3)
    far = next(line for line in tracker_results(evaluations) if line.label.startswith("Far"))
    curve = over_time(far, "endpoint_error_mm")
    assert len(curve.seconds) == 3
    assert curve.worst_of == 3
    np.testing.assert_allclose(curve.median, [9, 20, 9], atol=1e-6)


def test_shares_count_all_runs(evaluations: list[Evaluation]) -> None:
    near = next(line for line in tracker_results(evaluations) if line.label == "Near")
    found = shares(near)
    assert found is not None
    thresholds, share = found
    assert share[np.searchsorted(thresholds, 1.5)] == 0
    assert share[np.searchsorted(thresholds, 3.0)] == 0.5
    assert share[np.searchsorted(thresholds, 5.0)] == 1


def test_worst_frames_lie_apart() -> None:
    values = np.array([1.0, 9.0, 8.0, 2.0, 7.0, np.nan, 3.0])
    assert worst_frames(values, 0.3 * np.arange(7, dtype=np.float64), count=3, apart=0.5) == [1, 4, 6]
    assert worst_frames(np.full(3, np.nan), np.arange(3.0), count=2) == []


def test_rare_peaks_leave_the_scale_readable(evaluations: list[Evaluation]) -> None:
    near = next(line for line in tracker_results(evaluations) if line.label == "Near")
    np.testing.assert_allclose(top_of_scale([over_time(near, "endpoint_error_mm")]), (4.4, 4))
    assert top_of_scale([]) == (1.0, 0.0)


class Told(TrackerResult):
    """A line with the figures it is given."""

    def __init__(
        self, recording: str, label: str, error: float | None, ms: float = 10.0, lost: int = 0, e3d: float = 2.0
    ) -> None:
        super().__init__(recording, label, ())
        object.__setattr__(self, "_told", (error, ms, lost))
        object.__setattr__(self, "_figures", {"tracker_ms": ms, "endpoint_error_mm": error, "e3d_mm": e3d})

    _told: tuple[float | None, float, int]
    _figures: dict[str, float | None]

    source = property(lambda self: self.recording)
    frames = property(lambda self: 100)
    lost = property(lambda self: self._told[2])
    truth = property(lambda self: None if self._told[0] is None else "endpoint_error_mm")

    def figure(self, metric: str, statistic: str) -> float | None:
        return self._figures.get(metric)


def said(lines: list[TrackerResult], **more: Any) -> str:
    found = verdict(lines, **more)
    return " ".join([f"{found.headline}.", *found.sentences]).replace("\u00a0", " ")


def test_a_single_tracker_is_told_for_itself() -> None:
    assert said([Told("a", "PSO", 3.21)]) == (
        "PSO follows the hand to 3.2 mm. That is its mean endpoint error, at 10.0 ms a frame. The hand was never lost."
    )


def test_the_headline_says_where_a_tracker_is_at_home() -> None:
    lines: list[TrackerResult] = [Told("a", "PSO", 3.0), Told("a", "IK", 2.0)]
    assert said(lines, matched_model=("IK",)).startswith(
        "On its home ground, IK follows the hand more closely than PSO."
    )
    assert said(lines, matched_model=("PSO",)).startswith(
        "On the home ground of PSO, IK follows the hand more closely than PSO."
    )
    lines.append(Told("b", "PSO", 1.0))
    assert said(lines, matched_model=("IK",)).startswith(
        "Neither tracker is the closest everywhere, on the home ground of IK."
    )
    assert "home ground" not in said(lines)


def test_equal_figures_have_no_winner() -> None:
    text = said([Told("a", "PSO", 3.0), Told("a", "IK", 3.1, ms=10.2)])
    assert text.startswith("PSO and IK follow the hand equally closely.")
    assert "They take the same time a frame: PSO 10.0 ms and IK 10.2 ms." in text


def test_many_trackers_and_equal_time() -> None:
    lines: list[TrackerResult] = [Told("a", "A", 3.0, lost=2), Told("a", "B", 0.5, ms=9), Told("a", "C", 7.0, lost=1)]
    assert said(lines, equal_ms=10) == (
        "B follows the hand most closely of three trackers. B's mean endpoint error is 0.50 mm, A's 3.0 mm and "
        "C's 7.0 mm. Each was given 10 ms a frame; taken were: B 9.0 ms, A 10.0 ms and C 10.0 ms. "
        "The hand was lost by A in 2 of 100 frames and C in 1 of 100 frames; never by B."
    )


def test_different_winners_are_told_apart() -> None:
    lines: list[TrackerResult] = [Told("a", "A", 3.0), Told("a", "B", 4.0), Told("b", "A", 9.0), Told("b", "B", 1.0)]
    assert said(lines).startswith(
        "Neither tracker is the closest everywhere. Closest are A on a (3.0 mm mean endpoint error; B 4.0 mm) and "
        "B on b (1.0 mm mean endpoint error; A 9.0 mm)."
    )
    many: list[TrackerResult] = [
        Told(str(k), label, 1.0 + (k % 3 == 0) * s) for k in range(6) for label, s in (("A", 1), ("B", 2))
    ]
    many += [Told("6", "A", 5.0), Told("6", "B", 1.0)]
    assert "Of 7 recordings, the closest is A on 6 and B on 1." in said(many)


def test_recordings_without_a_truth_are_left_out_of_errors() -> None:
    lines: list[TrackerResult] = [
        Told("a", "A", 3.0),
        Told("a", "B", 4.0),
        Told("b", "A", None),
        Told("b", "B", None, e3d=1.0),
    ]
    text = said(lines)
    assert text.startswith("Where the truth is known, A follows the hand more closely than B.")
    assert "Where no truth is known, the sensor's points lie nearest to B on 1 of 1." in text
    assert "A's mean endpoint error is 3.0 mm on the one of two recordings with a known truth, B's 4.0 mm." in text
    assert [round(each.error, 6) for each in standings([Told("a", "A", 3.0), Told("b", "A", 5.0)])] == [4.0]


def test_who_finds_no_hand_is_not_judged_by_the_easy_recordings_alone() -> None:
    lines: list[TrackerResult] = [Told("a", "A", 3.0), Told("b", "A", 9.0), Told("a", "B", 2.0), Told("b", "B", None)]
    assert [(each.label, each.error) for each in standings(lines)] == [("A", 6.0), ("B", float("inf"))]


def test_runs_by_hand_are_told_apart(recording: Path, tmp_path: Path) -> None:
    """Without a comparison's labels: by what is unusual of them, and where nothing is, by their folders."""
    poses = true_poses(recording)
    more: dict[str, Any] = {"variant": "default", "particles": 64, "seed": 0}
    runs = [
        write_run(tmp_path / "usual", recording, poses, **more),
        write_run(tmp_path / "paper", recording, poses, **more | {"variant": "paper"}),
        write_run(tmp_path / "again", recording, poses, **more | {"variant": "paper", "seed": 1}),
        write_run(tmp_path / "ik_a", recording, poses, tracker="ik", seed=0),
        write_run(tmp_path / "ik_b", recording, poses, tracker="ik", seed=0),
    ]
    lines = tracker_results([evaluate_run(run, residuals=False) for run in runs])
    assert [(line.label, len(line.evaluations)) for line in lines] == [
        ("PSO", 1),
        ("OIKONOMIDIS2011", 2),
        ("IK, ik_a", 1),
        ("IK, ik_b", 1),
    ]


def test_home_ground_is_told_of(evaluations: list[Evaluation], recording: Path, tmp_path: Path) -> None:
    skin = write_run(tmp_path / "skin", recording, true_poses(recording), tracker="ik", model="skin", label="Skin")
    compared = [*evaluations[:2], evaluate_run(skin, residuals=False)]
    lines = tracker_results(compared)
    told = bias_warning({"model": "skin"}, lines)
    assert told.startswith("Home ground")
    assert "that Skin fits, and Far <b> and Near do not" in told
    assert "that Far <b> and Near fit, and Skin does not" in bias_warning({"model": "primitives"}, lines)
    assert bias_warning({"sensor": "kinect1"}, lines) == ""
    assert matched_model({"model": "skin"}, lines) == ("Skin",)
    write_report(compared, tmp_path / "report.html")
    text = Reader((tmp_path / "report.html").read_text(encoding="utf-8")).text
    assert "On the home ground of Far <b> and Near, Skin follows the hand most closely of three trackers" in text
    assert matched_model({"model": "skin"}, lines[:1]) == ()
