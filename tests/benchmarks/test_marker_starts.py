"""The benchmark of starts: truth of its frames, rows and refusals."""

import json
from pathlib import Path

import numpy as np
import pytest

from depthtrack.benchmarks import marker_starts
from depthtrack.benchmarks.marker_starts import synthetic_frame, touching_frame
from depthtrack.cli import main
from depthtrack.errors import InputError
from depthtrack.markers.formats.registry import write_capture
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.synthesis.marker_capture import MarkerSynthesis, synthesise_markers


def test_synthetic_frames_have_shuffled_points_and_their_truth() -> None:
    points, truth = synthetic_frame(4, "13", "left", 3, 0.3)
    again, same = synthetic_frame(4, "13", "left", 3, 0.3)
    np.testing.assert_array_equal(points, again)
    np.testing.assert_array_equal(truth, same)
    seen = truth[truth >= 0]
    assert len(points) == len(seen) + 3
    assert len(set(seen.tolist())) == len(seen)
    assert 0 < len(seen) < 13
    complete, all_seen = synthetic_frame(4, "13", "left", 0, 0.0)
    assert sorted(all_seen.tolist()) == list(range(13))
    ordered = complete[all_seen]
    assert np.linalg.norm(ordered - ordered.mean(axis=0), axis=1).max() < 0.25


def test_rows_of_a_layout_are_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "starts", "--layouts", "13", "--trials", "1", "--seed", "3", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert [row["condition"] for row in rows] == [*marker_starts.CONDITIONS, marker_starts.TOUCHING]
    assert rows[0]["right"] == 1
    assert rows[-1]["trials"] == 2


def test_hands_of_a_frame_touch() -> None:
    points, (right, left) = touching_frame(4, "13", 2, 0.0)
    assert len({*right.tolist(), *left.tolist()}) == 26
    assert len(points) == 28
    apart = np.linalg.norm(points[right][:, None] - points[left], axis=-1)
    assert apart.min() < 0.05


def test_labels_of_a_capture_are_the_truth(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "made"
    assert main(["synth", "everyday", str(folder), "--markers", "13", "--frames", "20", "--fps", "60"]) == 0
    capsys.readouterr()
    capture = str(folder / "truth" / "labelled.csv")
    assert main(["bench", "starts", "--capture", capture, "-m", "13", "--trials", "1"]) == 0
    text = capsys.readouterr().out
    assert "right  labelled" in text
    assert "100.0%" in text


def test_models_without_labels_in_the_capture_are_refused(tmp_path: Path) -> None:
    made = synthesise_markers(MarkerSynthesis(layout="13", frames=3))
    (tmp_path / "other.json").write_text(
        MarkerModel("other", ("x", "y", "z"), np.zeros(3, np.int64), np.eye(3) * 0.05, np.zeros(3)).to_json()
    )
    write_capture(tmp_path / "labelled.csv", made.truth.labelled())
    plan = marker_starts.plan((), 1, 0, tmp_path / "labelled.csv", (str(tmp_path / "other.json"),))
    with pytest.raises(InputError, match="lacks labels of other"):
        marker_starts.run(plan)


def test_plan_needs_trials() -> None:
    with pytest.raises(InputError, match="at least 1 trial"):
        marker_starts.plan(("13",), 0, 0)
