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
from depthtrack.evaluation.compare.results import tracker_results
from depthtrack.evaluation.evaluate import Evaluation, evaluate_run
from depthtrack.recording import open_sequence
from depthtrack.report.build import write_report
from depthtrack.report.provenance import bias_warning, matched_model
from tests.support.runs import shifted, true_poses, write_run


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
    assert json.loads(capsys.readouterr().out)["frames"] == 8
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


def test_runs_without_labels_are_named_by_their_options(recording: Path, tmp_path: Path) -> None:
    """Runs are named by options that differ from the defaults, else by their folders.

    These runs have the layout of an earlier version, whose trackers followed no branches.
    """
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
        ("PSO refine=False final_fit.icp.posture_weight=0.0 interval=0.0", 1),
        ("OIKONOMIDIS2011", 2),
        ("IK posture_weight=0.0 interval=0.0 scoring.objective.posture_weight=0.0, ik_a", 1),
        ("IK posture_weight=0.0 interval=0.0 scoring.objective.posture_weight=0.0, ik_b", 1),
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
