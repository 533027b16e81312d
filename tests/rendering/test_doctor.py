"""`depthtrack doctor` reports which backends work, disagree, crash, hang or are missing."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from depthtrack.cli import main
from depthtrack.machine import usable_cores
from depthtrack.rendering import doctor, selfcheck
from depthtrack.rendering.doctor import Outcome, SystemInfo, Trial, attempt
from depthtrack.rendering.options import Objective
from depthtrack.rendering.oracle import OracleScorer
from depthtrack.rendering.selfcheck import SelfCheck, self_check

GOOD = SelfCheck("numba", True, 1e-5, 1e-7, 0, 70000, 123456.0)
TRIAL = Trial("a renderer", "egl", {"device": "gpu"})


def test_the_oracle_agrees_with_itself_in_a_separate_process() -> None:
    outcome = attempt(Trial("oracle", "oracle"))
    assert outcome.works
    assert outcome.check is not None
    assert outcome.check.energy_difference == outcome.check.depth_difference == outcome.check.silhouette_pixels == 0
    assert outcome.check.silhouette_total > 64 * 500
    assert outcome.check.hypotheses_per_s > 0


def test_no_match_in_the_scene_depends_on_rounding() -> None:
    """The margin of every match is several times the float32 rounding at that distance."""
    shape, target, poses = selfcheck.scene()
    with OracleScorer(shape) as oracle:
        oracle.set_target(target)
        depth = np.stack([oracle.render(pose) for pose in poses]).astype(np.float64)
    margin = np.abs(np.abs(depth - target.depth) - Objective().match_depth)
    assert margin[depth > 0].min() > 4.5e-7
    assert poses.shape == (64, 27)
    assert target.camera.shape == (64, 64)


def test_a_renderer_that_computes_wrongly_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    class Shifted(OracleScorer):
        def render(self, pose: object) -> np.ndarray:
            depth = super().render(pose)  # type: ignore[arg-type]
            return np.roll(np.where(depth > 0, depth + np.float32(2e-4), 0), 1, axis=1)

    monkeypatch.setattr(selfcheck, "create_scorer", lambda name, shape, objective: Shifted(shape, objective))
    check = self_check("oracle", seconds=0.01)
    assert not check.agrees
    assert check.depth_difference > 1e-4
    assert check.silhouette_pixels > 0.001 * check.silhouette_total


def pretend(body: str, folder: Path, monkeypatch: pytest.MonkeyPatch, time_limit: float = 30.0) -> Outcome:
    """Return the outcome of a trial whose process is a shell script."""
    script = folder / "python"
    script.write_text(f"#!/bin/sh\n{body}\n")
    script.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(script))
    return attempt(TRIAL, time_limit)


@pytest.mark.parametrize(
    ("body", "problem"),
    [
        ("echo 'driver: out of luck' >&2; kill -SEGV $$", "crashed with SIGSEGV: driver: out of luck"),
        ("sleep 60", "gave no result within 0.5 s"),
        ("sleep 60 & sleep 60", "gave no result within 0.5 s"),
        (
            "echo Traceback >&2; echo 'ImportError: no module' >&2; exit 1",
            "failed with exit code 1: ImportError: no module",
        ),
        ("exit 0", "failed with exit code 0: no message"),
        ("""echo '{"hypotheses_per_s": 1}'""", "failed with exit code 0"),
        ("""echo 'driver chatter'; echo '{"error": "run  apt-get install libegl1"}'""", "run  apt-get install libegl1"),
    ],
)
def test_the_failure_of_a_renderer_is_reported(
    body: str, problem: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    outcome = pretend(body, tmp_path, monkeypatch, time_limit=0.5 if "sleep" in body else 30)
    assert not outcome.works
    assert outcome.check is None
    assert outcome.problem is not None
    assert problem in outcome.problem


def test_a_check_that_disagrees_does_not_count_as_working(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    answer = json.dumps({**vars(GOOD), "energy_difference": 0.5})
    outcome = pretend(f"echo '{answer}'", tmp_path, monkeypatch)
    assert not outcome.works
    assert outcome.check is not None
    assert outcome.check.energy_difference == 0.5
    assert outcome.problem is not None
    assert "disagrees with the oracle" in outcome.problem


@pytest.fixture
def outcomes(monkeypatch: pytest.MonkeyPatch) -> list[Outcome]:
    """Replace the trials: the default works, a GPU is missing."""
    found = [
        Outcome(Trial("raster", "raster"), GOOD, None),
        Outcome(Trial("egl on a GPU", "egl", {"device": "gpu"}), None, "EGL finds no GPU; tried surfaceless"),
    ]
    monkeypatch.setattr(doctor, "examine", lambda time_limit, progress: found)
    return found


def test_the_report_is_aligned_and_names_the_problems(
    outcomes: list[Outcome], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["doctor"]) == 0
    lines = capsys.readouterr().out.splitlines()
    head = next(line for line in lines if line.startswith("renderer"))
    row = next(line for line in lines if line.startswith("raster"))
    assert row[: head.index("drawn by")].split() == ["raster", "yes", "123,456", "1e-05", "0.0001", "mm", "0", "px"]
    assert row[head.index("drawn by") :] == "numba, software"
    assert head.index("works") == row.index("yes")
    assert any("egl on a GPU" in line and "EGL finds no GPU" in line for line in lines)
    assert any(f"numpy {np.__version__}" in line for line in lines)


def test_json_contains_the_machine_and_every_renderer(
    outcomes: list[Outcome], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["doctor", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["machine"]["libraries"]["numpy"] == np.__version__
    assert report["machine"]["threads"] >= 1
    raster, gpu = report["renderers"]
    assert raster["works"]
    assert raster["check"]["hypotheses_per_s"] == 123456.0
    assert not gpu["works"]
    assert gpu["check"] is None
    assert gpu["trial"]["options"] == {"device": "gpu"}


def test_a_default_renderer_that_fails_ends_with_code_2(
    outcomes: list[Outcome], capsys: pytest.CaptureFixture[str]
) -> None:
    outcomes[0] = Outcome(outcomes[0].trial, None, "crashed with SIGILL: no message")
    assert main(["doctor"]) == 2
    assert "the default renderer, raster, does not work here: crashed with SIGILL" in capsys.readouterr().err


def test_a_time_limit_out_of_range_is_rejected(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "--time-limit", "0"]) == 2
    assert "--time-limit must be from 0.1 to 3600" in capsys.readouterr().err


def test_every_backend_has_a_trial() -> None:
    labels = [trial.label for trial in doctor.trials()]
    assert labels[0] == "raster"
    assert {"egl on a GPU", "egl in software", "osmesa", "oracle"} < set(labels)
    machine = SystemInfo.here()
    assert machine.threads == usable_cores()
    assert machine.libraries["numba"]
