"""Test the benchmark of segmentation: recordings, times, units."""

import json
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from depthtrack.benchmarks.speed import segmenting
from depthtrack.benchmarks.speed.segmenting import SegmentPlan
from depthtrack.cli import main
from depthtrack.errors import InputError
from depthtrack.synthesis.generate import Synthesis, Synthesiser, write_recording


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bench") / "short"
    write_recording(Synthesiser(Synthesis(background="wall", frames=4)), folder)
    return folder


@pytest.mark.slow
def test_rows_have_time_and_iou_with_and_without_colour(recording: Path) -> None:
    plan = segmenting.plan([recording], seconds=0.05)
    threads = cv2.getNumThreads()
    report = segmenting.run(plan)
    assert cv2.getNumThreads() == threads
    assert plan.row_count == len(report.rows) == 2
    assert [row.uses for row in report.rows] == ["colour and depth", "depth"]
    for row in report.rows:
        assert 0 < row.segment_ms < 1000
        assert 0 < row.cloud_ms < 1000
        assert row.frames == 3
        assert row.calls % 3 == 0
        assert row.points > 5000
        assert row.iou is not None
        assert row.iou > 0.85
    assert "0.9" in segmenting.as_text(report)


def test_without_colour_there_is_one_row(recording: Path) -> None:
    shot = segmenting.plan([recording]).shots[0]
    grey = replace(shot, frames=[replace(frame, colour=None) for frame in shot.frames], truth=[None] * 4)
    report = segmenting.run(SegmentPlan([grey], 0.01))
    assert [row.uses for row in report.rows] == ["depth"]
    assert report.rows[0].iou is None


def test_the_default_is_a_recording_of_each_camera(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(segmenting, "FRAMES", 2)
    plan = segmenting.plan()
    assert [shot.name for shot in plan.shots] == ["everyday, kinect1", "everyday, kinect2", "everyday, realsense"]
    assert plan.row_count == 6
    for shot in plan.shots:
        assert [frame.index for frame in shot.frames] == [segmenting.FIRST, segmenting.FIRST + 1]
        assert all(mask is not None and mask.shape == shot.frames[0].depth.shape for mask in shot.truth)


def test_recordings_without_a_hand_are_rejected(recording: Path) -> None:
    shot = segmenting.plan([recording]).shots[0]
    empty = [replace(frame, depth=np.zeros_like(frame.depth)) for frame in shot.frames]
    with pytest.raises(InputError, match="frame 0 shows no hand"):
        segmenting.run(SegmentPlan([replace(shot, frames=empty)], 0.01))
    with pytest.raises(InputError, match="seconds"):
        segmenting.plan(seconds=0)


def test_the_command_prints_json(recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "segment", "--recordings", str(recording), "--seconds", "0.01", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["benchmark"] == "segment"
    assert {row["recording"] for row in report["rows"]} == {"short"}
