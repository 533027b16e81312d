"""Test the benchmark of the whole pipeline: stages, rates, text and refusals."""

import json
from pathlib import Path

import pytest

from depthtrack.benchmarks.speed import pipeline
from depthtrack.benchmarks.speed.pipeline import PipelineReport, StageRow
from depthtrack.cli import main
from depthtrack.errors import InputError
from depthtrack.machine import describe_machine
from depthtrack.recording import open_sequence
from depthtrack.synthesis.generate import Synthesis, Synthesiser, write_recording
from depthtrack.tracking.configuration import IkConfig

FRAMES = 4


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bench") / "short"
    write_recording(Synthesiser(Synthesis(model="skin", frames=FRAMES)), folder)
    return folder


def test_the_whole_holds_its_stages(recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "pipeline", str(recording), "--trackers", "ik", "--threads", "1", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    rows = {row["stage"]: row for row in report["rows"]}
    assert {"whole", "read", "segment", "target", "fit", "confidence"} <= rows.keys()
    assert {row["frames"] for row in rows.values()} == {FRAMES - 1}
    whole = rows["whole"]
    assert whole["frames_per_s"] == pytest.approx(1e3 / whole["mean_ms"])
    assert 0 < whole["median_ms"] <= whole["p95_ms"] <= whole["max_ms"]
    inside = sum(row["mean_ms"] for stage, row in rows.items() if stage not in ("whole", "read"))
    assert inside <= whole["mean_ms"]


def test_the_recording_is_read_as_by_track(recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["bench", "pipeline", str(recording), "--trackers", "ik", "--threads", "1", "--frames", "2"]
    assert main([*command, "--camera", "missing.json"]) == 2
    assert "missing.json" in capsys.readouterr().err
    assert main([*command, "--depth-only", "--mirror"]) == 0


def test_the_text_has_a_line_a_stage() -> None:
    rows = [StageRow("ik", 2, "whole", 9, 8.0, 9.5, 12.0, 40.0, 105.3), StageRow("ik", 2, "fit", 9, 3.0, 3.1, 4.0, 5.0)]
    text = pipeline.as_text(PipelineReport("pipeline", describe_machine(), "waving", rows))
    assert "waving, 2 threads" in text
    assert [line.split() for line in text.splitlines() if "whole" in line or "fit" in line][:2] == [
        ["ik", "whole", "8.00", "9.50", "12.00", "40.00", "105"],
        ["fit", "3.00", "3.10", "4.00", "5.00"],
    ]


def test_a_deadline_concerns_the_trackers_that_have_one(recording: Path) -> None:
    opened = open_sequence(recording)
    made = pipeline.plan(recording, opened, ["ik", "pso"], "average", frames=2, threads=1, deadline=20.0)
    assert [getattr(config, "deadline", None) for config in made.trackers] == [20.0, None]
    assert made.trackers[0] == IkConfig(deadline=20.0)


def test_one_frame_is_too_short(tmp_path: Path) -> None:
    path = tmp_path / "one"
    write_recording(Synthesiser(Synthesis(frames=1)), path)
    with pytest.raises(InputError, match="at least two frames, found 1"):
        pipeline.plan(path, open_sequence(path), ["ik"], None, None, threads=1, deadline=None)
