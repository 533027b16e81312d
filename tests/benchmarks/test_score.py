"""Test the benchmark of scoring: workload, times, units, and scorers that do not run."""

import json
import sys
import time
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from depthtrack.benchmarks.speed import scoring
from depthtrack.benchmarks.speed.baselines import BASELINES, INSTALL, Baseline, BaselineMissingError
from depthtrack.benchmarks.speed.isolation import in_own_process
from depthtrack.benchmarks.speed.timing import time_calls
from depthtrack.benchmarks.speed.workload import CHECKED, HYPOTHESES, ROIS, make_workloads
from depthtrack.cli import main
from depthtrack.errors import InputError
from depthtrack.geometry.camera import PRESETS
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.pose import ANGLES
from depthtrack.hand.shape import HandShape
from depthtrack.machine import describe_machine, usable_cores
from depthtrack.rendering.oracle import OracleScorer


def test_the_workload_is_a_swarm_around_a_hand_at_half_a_metre() -> None:
    workloads = make_workloads()
    native, *reduced = workloads
    assert [workload.roi for workload in workloads] == list(ROIS)
    for target in native.targets:
        camera = target.camera
        assert camera.width == camera.height
        assert camera.fx == PRESETS["kinect1"].fx
        assert 0.4 < target.depth[target.silhouette].mean() < 0.6
        # The whole hand with a margin.
        edge = np.ones(camera.shape, np.bool_)
        edge[4:-4, 4:-4] = False
        assert target.silhouette.any()
        assert not target.silhouette[edge].any()
    for workload, side in zip(reduced, (96, 64), strict=True):
        assert {target.camera.shape for target in workload.targets} == {(side, side)}
        np.testing.assert_array_equal(workload.poses, native.poses)
    assert native.poses.shape == (len(native.targets), HYPOTHESES, 27)
    assert np.all((native.poses[..., ANGLES] >= LOWER) & (native.poses[..., ANGLES] <= UPPER))
    spread = native.poses.std(axis=1)
    assert np.all((spread[:, :3] > 0.005) & (spread[:, :3] < 0.02))
    again = make_workloads(["native"])[0]
    np.testing.assert_array_equal(again.poses, native.poses)
    np.testing.assert_array_equal(again.expected, native.expected)
    assert native.expected.shape == (len(native.targets), CHECKED)


def test_the_time_is_that_of_the_call() -> None:
    durations = time_calls(lambda: time.sleep(0.002), 0.02)
    assert 1 <= len(durations) <= 10
    assert durations.min() >= 0.002
    assert len(time_calls(lambda: time.sleep(0.002), 1e-9)) == 1


def test_rows_of_a_backend() -> None:
    workloads = make_workloads(["96", "64"])
    rows = list(scoring.measure("raster", workloads, 0.01))
    assert [(row.threads, row.roi) for row in rows] == [
        (threads, roi) for threads in sorted({1, usable_cores()}) for roi in ("96", "64")
    ]
    for row in rows:
        assert (row.backend, row.kind, row.batch) == ("raster", "backend", HYPOTHESES)
        assert (row.width, row.height) == (int(row.roi), int(row.roi))
        assert row.hypotheses_per_s >= row.hypotheses_per_s_median > 0
        assert row.microseconds == pytest.approx(1e6 / row.hypotheses_per_s)
        assert row.calls >= len(workloads[0].targets)
        assert row.first_call_s > 0
        # The last bit of one pixel's depth can change the energy by this difference.
        assert row.energy_error < 0.05


class MisplacedOracle(OracleScorer):
    """Oracle that moves each hypothesis by 5 mm to the right."""

    def score(self, poses: np.ndarray) -> np.ndarray:  # type: ignore[override]
        return super().score(poses + np.eye(27)[0] * 0.005)


def test_wrong_energies_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scoring, "create_scorer", lambda name, shape: MisplacedOracle(shape))
    (row,) = scoring.measure("oracle", make_workloads(["64"]), 0.001)
    assert row.energy_error > 0.5


def test_invalid_plans_are_rejected() -> None:
    with pytest.raises(InputError, match=r"raster.*embree; found vulkan"):
        scoring.plan(["raster", "vulkan"])
    for seconds in (0.0, -1.0, float("nan"), 1e9):
        with pytest.raises(InputError, match="seconds"):
            scoring.plan(["raster"], seconds)
    assert scoring.plan(["raster", "raster"]).scorers == ("raster",)
    assert "oracle" not in scoring.plan().scorers


def break_open3d(folder: Path, monkeypatch: pytest.MonkeyPatch, error: str) -> None:
    """Make the import of `open3d` fail."""
    (folder / "open3d.py").write_text(f"raise {error}\n")
    monkeypatch.syspath_prepend(folder)


def test_the_command_measures_available_scorers_and_lists_absent_ones(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    break_open3d(tmp_path, monkeypatch, "ModuleNotFoundError")
    out = tmp_path / "bench.json"
    arguments = ["bench", "score", "--backends", "raster", "open3d", "--seconds", "0.01", "--out", str(out)]
    assert main([*arguments, "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report == json.loads(out.read_text())
    assert not list(tmp_path.glob("*.part"))
    assert {row["roi"] for row in report["rows"]} == set(ROIS)
    assert set(report["rows"][0]) == {field.name for field in fields(scoring.ScoreRow)}
    assert report["absent"] == [{"backend": "open3d", "reason": f"not installed: run  {INSTALL['open3d']}"}]
    assert report["machine"]["cores"] == usable_cores()
    assert report["machine"]["versions"]["numba"]


def test_the_text_has_a_line_per_row_and_the_reasons_of_absent_scorers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    break_open3d(tmp_path, monkeypatch, "ImportError('libusb is missing')")
    report = scoring.run(scoring.ScorePlan(("raster", "open3d"), 0.001, ("64",)))
    text = scoring.as_text(report)
    assert sum(line.startswith("raster   64   64x64 ") for line in text.splitlines()) == len(report.rows)
    assert "open3d: installed, but does not load: libusb is missing" in text


def test_a_report_without_rows_is_an_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    break_open3d(tmp_path, monkeypatch, "ModuleNotFoundError")
    assert main(["bench", "score", "--backends", "open3d", "--seconds", "0.01"]) == 2
    captured = capsys.readouterr()
    assert INSTALL["open3d"] in captured.out
    assert "none of the requested backends runs here" in captured.err


@pytest.mark.parametrize("name", BASELINES)
def test_baselines_agree_with_the_oracle_except_for_facets(name: str) -> None:
    """Each runs in its own process, since one sets the platform of OpenGL."""
    try:
        rows = list(in_own_process(scoring.measure, name, make_workloads(["native", "64"]), 1e-3, timeout=120))
    except BaselineMissingError as missing:
        pytest.skip(f"{name}: {missing}")
    assert [row.roi for row in rows] == ["native", "64"]
    for row in rows:
        assert (row.backend, row.kind, row.threads) == (name, "peer", None)
        assert row.energy_error < 3


def test_the_objective_of_baselines_on_depth_maps_of_the_oracle() -> None:
    (workload,) = make_workloads(["96"])
    oracle = OracleScorer(workload.shape)

    class Perfect(Baseline):
        name = "perfect"

        def _load(self) -> None: ...

        def _prepare(self, camera: object) -> None:
            oracle.set_target(self.target)

        def _depth(self, transforms: np.ndarray) -> np.ndarray:
            return oracle.render(next(poses))

    poses = iter(workload.poses[0])
    baseline = Perfect(HandShape())
    baseline.set_target(workload.targets[0])
    np.testing.assert_allclose(baseline.score(workload.poses[0, :CHECKED]), workload.expected[0], atol=0.01)


def test_the_machine_is_described() -> None:
    machine = describe_machine()
    assert machine.cpu
    assert machine.versions["python"] == ".".join(map(str, sys.version_info[:3]))
