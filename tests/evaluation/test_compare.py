"""Test comparisons: trackers, equal time, runs that are kept and resumed, results."""

import csv
import json
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.cli import main
from depthtrack.errors import InputError
from depthtrack.evaluation.compare.budget import scale_work, search
from depthtrack.evaluation.compare.comparison import Comparison, ComparisonProgress, compare
from depthtrack.evaluation.compare.cpu_time import CpuTimed
from depthtrack.evaluation.compare.running import Source
from depthtrack.evaluation.compare.specs import TrackerSpec, read_specs
from depthtrack.recording.run_folder import Run
from depthtrack.recording.status import Status
from depthtrack.tracking.configuration import IkConfig, PsoConfig, TrackerConfig
from depthtrack.tracking.registry import tracker_config
from depthtrack.tracking.tracker import Estimate
from tests.support.dask import dask_scheduler, dask_workers
from tests.support.runs import synthesise
from tests.support.workers import InThisProcess

FRAMES = 8
QUICK = "pso:particles=12,generations=6,resolution=48,ik:icp_iterations=1,subsample=6"

# Two clusters at once would share two cores.
pytestmark = pytest.mark.xdist_group("dask")


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return synthesise(tmp_path_factory.mktemp("made") / "everyday", FRAMES)


@pytest.fixture(scope="module")
def compared(recording: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("compared")
    arguments = ["compare", str(recording), "-o", str(folder), "--trackers", QUICK, "--repeats", "2", "--jobs", "1"]
    assert main(arguments) == 0
    return folder


def test_trackers_are_read_from_text() -> None:
    assert read_specs(["pso,ik:surface=cylinders,icp_iterations=3", "pso:particles=16,resolution=64"]) == [
        TrackerSpec("PSO", PsoConfig()),
        TrackerSpec(
            "IK surface=cylinders icp_iterations=3", tracker_config("ik", surface="cylinders", icp_iterations=3)
        ),
        TrackerSpec("PSO particles=16 resolution=64", tracker_config("pso", particles=16, resolution=64)),
    ]


def test_trackers_are_read_from_a_file(tmp_path: Path) -> None:
    file = tmp_path / "trackers.toml"
    file.write_text('["As in 2011"]\ntracker = "oikonomidis2011"\n\n[surface]\ntracker = "ik"\nsubsample = 2\n')
    assert read_specs([str(file)]) == [
        TrackerSpec("As in 2011", tracker_config("oikonomidis2011")),
        TrackerSpec("surface", tracker_config("ik", subsample=2)),
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "at least one"),
        ("pso,kalman", "kalman"),
        ("ik:colour=red", "colour"),
        ("pso:particles=many", "particles"),
        ("pso:renderer=fast", "renderer"),
        ("pso:seed=3", "seed"),
        ("subsample=3", "subsample=3"),
        ("pso:particles", "particles"),
        ("pso,pso", "two trackers"),
        ("nowhere.toml", "nowhere.toml"),
    ],
)
def test_invalid_trackers_are_rejected(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_specs([text])


def test_a_deeply_nested_file_of_trackers_is_rejected(tmp_path: Path) -> None:
    file = tmp_path / "trackers.toml"
    file.write_text("ik = " + "[" * 50_000)
    with pytest.raises(InputError, match="cannot read the trackers"):
        read_specs([str(file)])


@given(st.floats(0.5, 500), st.floats(0, 20), st.floats(0.1, 40))
def test_the_budget_meets_its_milliseconds(ms: float, always: float, each: float) -> None:
    """The time is linear in the work; the budget is within one step of it, or at its limit."""

    def cost(config: TrackerConfig) -> float:
        assert isinstance(config, PsoConfig)
        return always + each * config.swarm.particles * config.swarm.generations / 1600

    budget = search(lambda size: scale_work(PsoConfig(), size), cost, ms)
    assert budget.ms == cost(budget.config)
    least, most = cost(scale_work(PsoConfig(), 1 / 32)), cost(scale_work(PsoConfig(), 64))
    reachable = min(max(ms, least), most)
    assert budget.ms == pytest.approx(reachable, rel=0.15)


def test_the_work_grows_with_the_size() -> None:
    assert scale_work(PsoConfig(), 1) == PsoConfig()
    assert scale_work(PsoConfig(), 4) == tracker_config("pso", particles=128, generations=50)
    assert scale_work(IkConfig(), 1) == IkConfig()
    fits = [scale_work(IkConfig(), size).fit for size in (0.1, 0.5, 1, 2, 4, 9, 30)]  # type: ignore[union-attr]
    work = [fit.icp.icp_iterations / fit.subsample for fit in fits]
    assert work == sorted(work)
    assert fits[-1].subsample == 1


class Idle:
    """Tracker that states 30 ms per frame."""

    name, stages = "idle", ("wait", "work")

    def predicted_pose(self, timestamp: float) -> None: ...

    def doubted_pose(self, timestamp: float) -> None: ...

    def start(self, observation: Any, pose: Any = None) -> Estimate:
        return Estimate(None, math.nan, 0.0, Status.LOST, {"wait": 20.0, "work": 10.0})

    track = start

    def restore(self, estimates: Any) -> None: ...
    def close(self) -> None: ...


def test_stages_are_scaled_to_the_cpu_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """The sum is that of the process's clock, and the shares are the tracker's.

    The clock is replaced, since threads of other tests would count as well.
    """
    monkeypatch.setattr("time.process_time", iter([5.0, 5.003]).__next__)
    stage_ms = CpuTimed(Idle()).track(None).stage_ms  # type: ignore[arg-type]
    assert stage_ms == pytest.approx({"wait": 2.0, "work": 1.0})


def test_results_equal_the_runs(compared: Path) -> None:
    runs = sorted((compared / "runs").iterdir())
    assert len(runs) == 4
    rows = json.loads((compared / "results.json").read_text())
    assert [(row["tracker"], row["seed"]) for row in rows] == [("pso", 0), ("pso", 1), ("ik", 0), ("ik", 1)]
    with (compared / "results.csv").open(newline="") as file:
        flat = list(csv.DictReader(file))
    for row, columns in zip(rows, flat, strict=True):
        run = Run.load(Path(row["run"]))
        assert len(run.index) == row["frames"] == FRAMES
        assert run.configuration["options"]["seed"] == row["seed"]
        assert run.configuration["clock"] == row["clock"] == "cpu"
        assert float(columns["endpoint_error_mm_mean"]) == pytest.approx(row["endpoint_error_mm"]["mean"])
        spent = sum(values for stage, values in run.stage_ms.items() if stage != "segment")
        tracked = np.array([status == "tracked" for status in run.status])
        assert row["tracker_ms"]["mean"] == pytest.approx(np.mean(np.asarray(spent)[tracked]), rel=1e-3)
    # A run stores given and default options.
    assert Run.load(Path(rows[0]["run"])).configuration["options"]["swarm"]["particles"] == 12
    assert Run.load(Path(rows[0]["run"])).configuration["options"]["scoring"]["renderer"] == "raster"


def test_the_table_has_one_row_per_tracker_and_nothing_is_tracked_again(
    recording: Path, compared: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["compare", str(recording), "-o", str(compared), "--trackers", QUICK, "--repeats", "2", "--jobs", "1"]
    before = {file: file.stat().st_mtime_ns for file in compared.glob("runs/*/poses.csv")}
    assert main(arguments) == 0
    head, pso, ik = capsys.readouterr().out.splitlines()[:3]
    assert "error mean mm" in head
    assert "PSO particles=12" in pso
    assert "IK icp_iterations=1" in ik
    assert before == {file: file.stat().st_mtime_ns for file in compared.glob("runs/*/poses.csv")}


@pytest.mark.slow
def test_a_killed_comparison_continues_to_the_same_poses(recording: Path, compared: Path, tmp_path: Path) -> None:
    folder = tmp_path / "killed"
    command = [sys.executable, "-m", "depthtrack", "compare", str(recording), "-o", str(folder), "--trackers", QUICK]
    command += ["--repeats", "2", "--jobs", "1"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline and process.poll() is None:
        begun = list(folder.glob("runs/*/poses.csv"))
        if begun and len(begun[0].read_text().splitlines()) > 3:
            os.killpg(process.pid, signal.SIGKILL)
            break
        time.sleep(0.002)
    process.wait()
    assert len(list(folder.glob("runs/*/done.json"))) < 4
    assert main(command[3:]) == 0
    for run in (compared / "runs").iterdir():
        assert (folder / "runs" / run.name / "poses.csv").read_bytes() == (run / "poses.csv").read_bytes()


@pytest.mark.slow
def test_a_dask_cluster_makes_the_same_runs(recording: Path, compared: Path, tmp_path: Path) -> None:
    out, surface = tmp_path / "out", QUICK[QUICK.index("ik:") :]
    arguments = ["compare", str(recording), "-o", str(out), "--trackers", surface, "--repeats", "2"]
    with dask_scheduler(tmp_path) as (address, _), dask_workers(address, tmp_path):
        assert main([*arguments, "--scheduler", address]) == 0
    for run in (out / "runs").iterdir():
        assert (run / "poses.csv").read_bytes() == (compared / "runs" / run.name / "poses.csv").read_bytes()
    assert len(json.loads((out / "results.json").read_text())) == 2


def test_runs_of_a_comparison_use_their_keypoints(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder, out = synthesise(tmp_path / "made", 2, "--keypoints"), tmp_path / "out"
    file = folder / "keypoints.csv"
    command = ["compare", str(folder), "-o", str(out), "--trackers", "lift", "--side", "right", "--jobs", "1"]
    assert main([*command, "--keypoints", str(file)]) == 0
    (run,) = (out / "runs").iterdir()
    assert Run.load(run).configuration["keypoints"] == str(file.resolve())
    assert main([*command, "--keypoints", str(file), str(file)]) == 2
    assert "--keypoints needs a file for each recording" in capsys.readouterr().err


def test_other_options_need_another_folder(recording: Path, compared: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["compare", str(recording), "-o", str(compared), "--jobs", "1", "--trackers", QUICK, "--frames", "3"]
    assert main(arguments) == 2
    message = capsys.readouterr().err
    assert "frames" in message
    assert "another folder" in message


def test_equal_time_is_measured_once_and_stored(recording: Path, tmp_path: Path) -> None:
    source = Source(str(recording), frames=6)
    comparison = Comparison((source,), tuple(read_specs(["pso:resolution=48,ik:subsample=6"])), equal_ms=6.0)
    reported: list[ComparisonProgress] = []
    plans = compare(comparison, tmp_path, InThisProcess(), reported.append)
    assert "6 ms" in reported[0].step
    assert (reported[-1].frames, reported[-1].total) == (12, 12)
    for plan in plans:
        stored = Run.load(Path(plan.folder)).configuration
        assert stored["budget"]["equal_ms"] == 6.0
        assert stored["budget"]["calibrated_ms"] > 0
    assert Run.load(Path(plans[0].folder)).configuration["options"]["scoring"]["resolution"] == 48
    assert Run.load(Path(plans[1].folder)).configuration["options"] == plans[1].options
    # A second measurement would differ slightly.
    again = compare(comparison, tmp_path, InThisProcess())
    assert again == plans


def test_recordings_of_one_name_get_different_folders(recording: Path, tmp_path: Path) -> None:
    other = tmp_path / "other" / "everyday"
    assert main(["synth", "everyday", str(other), "--frames", "3", "--seed", "4"]) == 0
    specs = tuple(read_specs(["ik:icp_iterations=1,subsample=6"]))
    comparison = Comparison((Source(str(recording), frames=3), Source(str(other))), specs)
    first, second = compare(comparison, tmp_path / "out", InThisProcess())
    assert first.folder != second.folder
    assert Run.load(Path(second.folder)).configuration["sequence"] == str(other)


@pytest.mark.parametrize(
    ("more", "expected"),
    [
        (["--repeats", "0"], "repeats"),
        (["--equal-time", "0"], "--equal-time"),
        (["--frames", "0"], "--frames"),
        (["--jobs", "0"], "--jobs"),
        (["--hand", "nobody.json"], "nobody.json"),
        (["--camera", "a.json", "--camera-preset", "tum"], "give one"),
    ],
)
def test_errors_are_one_sentence_without_traceback(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], more: list[str], expected: str
) -> None:
    assert main(["compare", str(recording), "-o", str(tmp_path / "out"), "--trackers", "ik", *more]) == 2
    message = capsys.readouterr().err
    assert expected in message
    assert "Traceback" not in message
