"""Scores of marker folders: labels, positions and angles."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from depthtrack.cli import main
from depthtrack.errors import InputError
from depthtrack.evaluation.marker_evaluation import MarkerEvaluation, MarkerTruth, evaluate_labelled
from depthtrack.evaluation.metrics.markers import AngleErrors, PositionErrors, label_score
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.filled_capture import FilledCapture, Filling
from depthtrack.markers.folder.contents import Source
from depthtrack.markers.folder.writing import write_marker_folder
from depthtrack.markers.formats.registry import write_capture
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.synthesis.marker_capture import MarkerSynthesis, SyntheticMarkers, synthesise_markers
from depthtrack.synthesis.marker_folder import write_synthetic_markers
from depthtrack.types import Array, Index

FRAMES = 60


@pytest.fixture(scope="module")
def synthetic() -> SyntheticMarkers:
    return synthesise_markers(MarkerSynthesis("grasp", "13", two_hands=True, frames=FRAMES, rigid_bodies=1))


def truth_of(synthetic: SyntheticMarkers) -> MarkerTruth:
    poses = dict(zip(("right", "left"), synthetic.truth.poses[:2], strict=True))
    return MarkerTruth("truth", synthetic.truth.labelled(), synthetic.complete, poses)


def with_columns(labelled: LabelledCapture, k: int, columns: Index) -> LabelledCapture:
    return replace(labelled, columns=(*labelled.columns[:k], columns, *labelled.columns[k + 1 :]))


def scored(labelled: LabelledCapture, synthetic: SyntheticMarkers) -> MarkerEvaluation:
    return evaluate_labelled(labelled, truth_of(synthetic))


def test_the_truth_has_perfect_scores(synthetic: SyntheticMarkers) -> None:
    found = scored(synthetic.truth, synthetic)
    score = found.labels
    assert (score.accuracy, score.precision, score.recall, score.f1) == (1, 1, 1, 1)
    assert score.errors == ()
    assert score.rejected == 2 * (FRAMES - 1)
    assert found.positions.of(np.ones_like(found.positions.filled))["mean"] == pytest.approx(0.8, abs=0.05)
    assert [errors.mean for errors in found.angles.values()] == [0, 0]
    assert list(found.angles) == ["right", "left"]


def test_a_swap_of_two_markers_is_listed_with_its_frames(synthetic: SyntheticMarkers) -> None:
    columns = synthetic.truth.columns[0].copy()
    pair = np.flatnonzero((columns[10:20] >= 0).all(axis=0))[:2]
    columns[10:20, pair] = columns[10:20, pair[::-1]]
    score = scored(with_columns(synthetic.truth, 0, columns), synthetic).labels
    one, other = (synthetic.truth.labels(0)[m] for m in pair)
    assert score.swapped.sum() == 20
    assert score.missed.sum() == score.false.sum() == 0
    assert set(score.errors) == {(one, other, 10, 19), (other, one, 10, 19)}
    samples = score.right.sum() + 20
    assert score.recall == score.precision == score.f1 == pytest.approx(1 - 20 / samples)


def test_a_labelled_ghost_is_of_no_marker(synthetic: SyntheticMarkers) -> None:
    columns, capture = synthetic.truth.columns[0].copy(), synthetic.truth.capture
    used = np.concatenate(synthetic.truth.columns, axis=1)[30]
    ghost = next(c for c in capture.points(30)[1] if c not in used)
    columns[30, 5] = ghost
    score = scored(with_columns(synthetic.truth, 0, columns), synthetic).labels
    assert score.false.sum() == 1
    assert score.missed.sum() == (synthetic.truth.columns[0][30, 5] >= 0)
    assert score.rejected == 2 * (FRAMES - 1) - 1
    assert [(e.given, e.true, e.first, e.last) for e in score.errors] == [(synthetic.truth.labels(0)[5], None, 30, 30)]


def test_missed_samples_lower_the_recall_alone(synthetic: SyntheticMarkers) -> None:
    columns = synthetic.truth.columns[1].copy()
    columns[:, 0] = -1
    score = scored(with_columns(synthetic.truth, 1, columns), synthetic).labels
    assert score.precision == 1
    assert score.missed.sum() == (synthetic.truth.columns[1][:, 0] >= 0).sum()
    assert score.recall is not None
    assert score.recall < 1


def slow_score(given: Array, true: Array, expected: Index) -> tuple[int, int, int, int]:
    """Count right, swapped, false and missed samples one by one."""
    right = swapped = false = missed = 0
    for frame in range(len(given)):
        taken = set()
        for m in range(given.shape[1]):
            if np.isnan(given[frame, m]).any():
                continue
            match = [n for n in range(true.shape[1]) if np.array_equal(given[frame, m], true[frame, n])]
            taken.update(match)
            if match and match[0] == expected[m]:
                right += 1
            elif match and match[0] in expected:
                swapped += 1
            else:
                false += 1
        for n in range(true.shape[1]):
            missed += bool(np.isfinite(true[frame, n]).all() and n not in taken and n in expected)
    return right, swapped, false, missed


@given(st.integers(1, 300), st.integers(1, 5), st.integers(1, 6), st.integers(0, 1000))
@settings(max_examples=40, deadline=None)
def test_scores_equal_those_counted_one_by_one(frames: int, markers: int, others: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    true = rng.normal(size=(frames, others, 3))
    true[rng.random((frames, others)) < 0.3] = np.nan
    points = np.concatenate([true, rng.normal(size=(frames, markers, 3))], axis=1)
    order = np.argsort(rng.random(points.shape[:2]), axis=1)[:, :markers]
    labelled = np.take_along_axis(points, order[..., None], axis=1)
    expected = np.full(markers, -1)
    expected[: min(markers, others)] = rng.permutation(others)[:markers]
    count = int(np.isfinite(points).all(axis=-1).sum())
    names = [f"m{m}" for m in range(markers)]
    score = label_score(names, labelled, true, [f"t{n}" for n in range(others)], expected, count)
    found = tuple(int(values.sum()) for values in (score.right, score.swapped, score.false, score.missed))
    assert found == slow_score(labelled, true, expected)
    assert sum(e.last - e.first + 1 for e in score.errors) == found[1] + found[2]


def test_filled_gaps_are_listed_apart_from_measured_samples() -> None:
    how = np.full((10, 2), "measured", dtype="<U12")
    how[2:5, 0], how[7:9, 1] = "spline", "kinematic"
    mm = np.arange(20.0).reshape(10, 2)
    mm[8, 1] = np.nan
    errors = PositionErrors(("a", "b"), mm, how, np.where(how == "spline", 6.0, np.nan))
    report = errors.to_json()
    assert report["measured"]["samples"] == 15
    assert report["by_way"]["spline"] == {"samples": 3, "mean": 6, "median": 6, "p95": pytest.approx(7.8), "max": 8}
    assert [tuple(gap.values()) for gap in report["gaps"]] == [
        ("a", "spline", 2, 4, 6.0, 8.0),
        ("b", "kinematic", 7, 7, 15.0, 15.0),
    ]
    assert report["filled_error_over_expected"] == pytest.approx(np.sqrt((16 + 36 + 64) / 3) / 6)
    assert list(report["filled_by_marker"]) == ["a", "b"]


def test_angle_errors_separate_fingers_with_dropped_markers() -> None:
    poses, true = np.zeros((2, 27)), np.zeros((2, 27))
    poses[0, 7:11] = np.radians(4)
    measured = np.array([[False, True], [True, True]])
    errors = AngleErrors.between(poses, true, measured, np.array([1, 4]))
    assert errors.mean == pytest.approx(4 * 4 / 40)
    report = errors.to_json()
    assert report["dropped_angle_error_deg"] == pytest.approx(4)
    assert report["seen_angle_error_deg"] == pytest.approx(0)
    poses[1] = np.nan
    assert AngleErrors.between(poses, true, measured, np.array([1, 4])).to_json()["frames"] == 1


def test_labels_of_a_file_are_found_whatever_the_punctuation(synthetic: SyntheticMarkers, tmp_path: Path) -> None:
    labelled = synthetic.truth.labelled()
    renamed = replace(labelled, labels=tuple(label.replace(":", "-").upper() for label in labelled.labels))
    write_capture(tmp_path / "labels.csv", renamed)
    found = evaluate_labelled(synthetic.truth, MarkerTruth.of_capture(tmp_path / "labels.csv"))
    assert found.labels.recall == 1
    assert found.angles == {}


def test_points_of_other_markers_need_no_label(synthetic: SyntheticMarkers) -> None:
    hand = replace(
        synthetic.truth,
        models=synthetic.truth.models[:1],
        columns=synthetic.truth.columns[:1],
        poses=synthetic.truth.poses[:1],
        confidence=synthetic.truth.confidence[:1],
    )
    score = scored(hand, synthetic).labels
    assert score.accuracy == score.recall == 1
    assert score.rejected > 13 * FRAMES


def test_the_command_compares_a_folder_with_its_source(
    synthetic: SyntheticMarkers, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made, run = tmp_path / "made", tmp_path / "run"
    write_synthetic_markers(synthetic, made)
    write_marker_folder(run, synthetic.truth, Source.of(made / "capture.csv"))
    assert main(["evaluate", str(run), "--json"]) == 0
    report = json.loads(capsys.readouterr().out, parse_constant=lambda name: pytest.fail(name))
    assert report["labels"]["accuracy"] == 1
    assert report["hands"]["left"]["angle_error_deg"]["max"] == 0
    assert report["position_error_mm"]["measured"]["mean"] == pytest.approx(0.8, abs=0.05)
    for options in ((), ("--truth", str(made)), ("--labels", str(made / "truth" / "labelled.csv"))):
        assert main(["evaluate", str(run), *options]) == 0
        assert "accuracy 100.000 %" in capsys.readouterr().out
    assert main(["evaluate", str(run), "--truth", str(made), "--labels", str(made / "capture.csv")]) == 2
    assert "give one of them" in capsys.readouterr().err
    assert main(["evaluate", str(made / "truth")]) == 2
    assert "give --labels FILE or --truth FOLDER" in capsys.readouterr().err
    assert main(["evaluate", str(run), "--labels", str(made / "capture.csv")]) == 2
    assert "no labelled trajectory" in capsys.readouterr().err


def test_other_frames_and_other_labels_are_rejected(synthetic: SyntheticMarkers) -> None:
    truth = truth_of(synthetic)
    short = replace(truth, samples=replace(truth.samples, positions=truth.samples.positions[1:]))
    with pytest.raises(InputError, match=f"must have the {FRAMES} frames"):
        evaluate_labelled(synthetic.truth, short)
    strange = MarkerCapture(200.0, ("x",), np.zeros((FRAMES, 1, 3)))
    with pytest.raises(InputError, match="has none of the labels"):
        evaluate_labelled(synthetic.truth, MarkerTruth("file", strange, strange, {}))


def test_cut_samples_need_no_label_and_filled_ones_are_compared(synthetic: SyntheticMarkers) -> None:
    columns, points = synthetic.truth.columns[0].copy(), synthetic.truth.capture.positions.copy()
    seen = np.flatnonzero(columns[10:30, 4] >= 0) + 10
    points[seen, columns[seen, 4]] = np.nan
    columns[10:30, 4] = -1
    cut = with_columns(replace(synthetic.truth, capture=replace(synthetic.truth.capture, positions=points)), 0, columns)
    positions = [cut.positions(k) for k in range(len(cut.models))]
    how = [np.where(c >= 0, Filling.MEASURED, Filling.GAP) for c in cut.columns]
    expected = [np.full(c.shape, np.nan) for c in cut.columns]
    positions[0][10:30, 4] = synthetic.positions[0][10:30, 4] + [0, 0.003, 0]
    how[0][10:30, 4], expected[0][10:30, 4] = Filling.SMOOTHED, 0.002
    filled = FilledCapture(cut, tuple(positions), tuple(how), tuple(expected), cut.poses)
    found = evaluate_labelled(cut, truth_of(synthetic), filled=filled)
    assert found.labels.recall == 1
    report = found.to_json()["position_error_mm"]
    assert report["by_way"] == {
        "smoothed": {"samples": 20, **dict.fromkeys(("mean", "median", "p95", "max"), pytest.approx(3))}
    }
    assert report["filled_error_over_expected"] == pytest.approx(1.5)
    assert [(gap["first"], gap["last"]) for gap in report["gaps"]] == [(10, 29)]


def test_another_capture_of_the_same_labels_is_rejected(synthetic: SyntheticMarkers) -> None:
    truth = truth_of(synthetic)
    moved = replace(truth, samples=replace(truth.samples, positions=truth.samples.positions + 0.001))
    with pytest.raises(InputError, match="another capture"):
        evaluate_labelled(synthetic.truth, moved)
