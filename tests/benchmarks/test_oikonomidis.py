"""The papers' experiments: what they observe, what they count, how they are summarised, and where it is written."""

import csv
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from depthtrack.benchmarks.papers import oikonomidis as following
from depthtrack.benchmarks.papers import oikonomidis_4
from depthtrack.benchmarks.papers.experiment import Experiment, ExperimentOptions
from depthtrack.benchmarks.papers.registry import (
    EXPERIMENTS,
    SHORT_NAMES,
    chosen_experiments,
    full_cell,
    load_experiment,
    measure_cell,
)
from depthtrack.benchmarks.papers.reproduce import reproduce
from depthtrack.cli import main
from depthtrack.errors import InputError
from depthtrack.evaluation.sweep.local import LocalWorkers
from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.geometry.rotations import quaternion_exp
from depthtrack.hand.pose import make_pose
from depthtrack.rendering.oracle import OracleScorer
from depthtrack.segmentation.options import RoiOptions
from depthtrack.synthesis import observations
from depthtrack.synthesis.generate import Synthesis, Synthesiser
from depthtrack.synthesis.observations import observation_of, observed_motion
from tests.support.workers import InThisProcess

TINY = ExperimentOptions(quick=True, repetitions=1, resolution=32, frames=2)
TIMES = ("seconds", "ms_per_frame", "ms")
SWARM = [name for name in EXPERIMENTS if name.startswith("oikonomidis-")]


def untimed(rows: list[Row]) -> list[Row]:
    return [{name: value for name, value in row.items() if name not in TIMES} for row in rows]


def cells_of(name: str, **options: Any) -> list[Cell]:
    return load_experiment(name).cells(ExperimentOptions(**options))


# What is observed


@pytest.mark.parametrize("recording", [Synthesis(frames=30), Synthesis(frames=30, distance=2.0, viewpoint=5)])
def test_an_observed_motion_shows_the_true_hand_with_a_margin(recording: Synthesis) -> None:
    seen, oracle = observed_motion(recording), OracleScorer(recording.hand)
    for index in (0, 29):
        observation = seen[index]
        oracle.set_target(observation)
        expected = oracle.render(seen.poses[index])
        np.testing.assert_array_equal(observation.silhouette, expected > 0)
        np.testing.assert_allclose(observation.depth, expected, atol=2e-4)
        assert oracle.score(seen.poses[[index]])[0] < 0.5
        rows, columns = np.nonzero(observation.silhouette)
        height, width = observation.silhouette.shape
        pixel = np.median(expected[expected > 0]) / observation.camera.fx
        for room in (rows.min(), columns.min(), height - 1 - rows.max(), width - 1 - columns.max()):
            assert room * pixel == pytest.approx(RoiOptions().margin, rel=0.05)
        assert np.linalg.norm(observation.centre - seen.poses[index, :3]) < 0.06


def test_an_observed_motion_has_the_requested_noise() -> None:
    clean, noisy = (
        observed_motion(Synthesis(frames=1))[0],
        observed_motion(Synthesis(frames=1, depth_noise=0.02, skin_flips=0.3))[0],
    )
    assert noisy.camera == clean.camera
    error = (noisy.depth - clean.depth)[clean.depth > 0]
    assert error.std() == pytest.approx(0.02, rel=0.05)
    assert np.mean(noisy.silhouette != clean.silhouette) == pytest.approx(0.3, rel=0.05)


def test_each_frame_is_made_once_and_few_motions_are_cached(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[int] = []

    def counted(frame: Any, source: Synthesiser, index: int) -> Any:
        made.append(index)
        return observation_of(frame, source, index)

    monkeypatch.setattr(observations, "observation_of", counted)
    recording = Synthesis(frames=2, seed=77)
    for _ in range(3):
        assert observed_motion(recording)[1] is observed_motion(recording)[1]
    assert made == [1]
    for seed in range(observations.MOTIONS_KEPT):
        observed_motion(Synthesis(frames=2, seed=78 + seed))
    observed_motion(recording)[1]
    assert made == [1, 1]


# What is varied


def test_the_cells_are_the_papers() -> None:
    assert {name: len(cells_of(name)) for name in SWARM} == {
        "oikonomidis-2a": 5 * 8 * 20,
        "oikonomidis-2b": 9 * 20,
        "oikonomidis-2c": 5 * 5 * 20,
        "oikonomidis-2d": 8 * 20,
        "oikonomidis-4": 45 * 20,
    }
    budgets = {(cell["particles"], cell["generations"]) for cell in cells_of("oikonomidis-2a")}
    assert (64, 25) in budgets
    assert {cell["viewpoint"] for cell in cells_of("oikonomidis-2d")} == set(range(8))
    distances = {cell["distance_m"] for cell in cells_of("oikonomidis-2b")}
    assert (min(distances), max(distances)) == (0.5, 2.5)
    noise = {(cell["depth_noise_mm"], cell["skin_flips_percent"]) for cell in cells_of("oikonomidis-2c")}
    assert (0, 0) in noise
    frames = sorted({cell["frame"] for cell in cells_of("oikonomidis-4")})
    assert set(np.diff(frames)) == {8}
    for name in SWARM:
        cells = cells_of(name)
        assert len({json.dumps(cell) for cell in cells}) == len(cells)
        assert {cell["repetition"] for cell in cells} == set(range(20))
        assert {cell["resolution"] for cell in cells} == {None}
        assert all(json.loads(json.dumps(cell)) == cell for cell in cells)


@pytest.mark.parametrize("name", SWARM)
def test_quick_is_coarser_and_options_reach_the_cells(name: str) -> None:
    quick = cells_of(name, quick=True)
    assert len(quick) <= len(cells_of(name)) / 4
    assert {cell["resolution"] for cell in quick} == {96}
    chosen = cells_of(name, quick=True, variant="paper", renderer="osmesa", resolution=50, repetitions=2)
    assert {(cell["variant"], cell["renderer"], cell["resolution"], cell["repetition"]) for cell in chosen} == {
        ("paper", "osmesa", 50, repetition) for repetition in (0, 1)
    }
    for repetitions in (0, -1, 10**9):
        with pytest.raises(InputError, match=r"repetitions must lie between 1 and 10000"):
            cells_of(name, repetitions=repetitions)


# What is measured


def follow(**changes: Any) -> Row:
    (cell,) = following.cells(TINY, [changes])
    return following.follow(**(cell | {"frames": 4} | changes))


def test_following_is_repeatable_and_finds_the_hand() -> None:
    row = follow(resolution=96)
    assert 0.05 < row["error_mm"] < 4
    assert row["median_frame_mm"] <= row["p95_frame_mm"]
    assert untimed([follow(resolution=96)]) == untimed([row])
    assert follow(resolution=96, repetition=1)["error_mm"] != row["error_mm"]
    assert follow(resolution=96, variant="paper")["error_mm"] != row["error_mm"]


def test_following_is_worse_with_heavy_noise_and_with_no_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    # The swarm follows alone, however high the energy: a search would fail here.
    monkeypatch.setattr("depthtrack.tracking.stages.searches.orientation_proposals", None)
    good = follow()["error_mm"]
    assert follow(depth_noise_mm=80.0, skin_flips_percent=40.0)["error_mm"] > 1.5 * good
    assert follow(particles=4, generations=1)["error_mm"] > 1.5 * good


def test_a_start_is_measured_against_the_truth_of_its_frame() -> None:
    (cell, *_) = cells_of("oikonomidis-4", quick=True, repetitions=1, resolution=48)
    row = oikonomidis_4.measure(**cell)
    assert row["status"] == "started"
    assert 0.5 < row["error_mm"] < 15
    assert 0 < row["palm_turned_deg"] < 25
    assert row["mirrored"] is False


def test_a_palm_taken_for_its_back_is_mirrored() -> None:
    def pose(turn: list[float]) -> np.ndarray:
        return make_pose(np.zeros(3), quaternion_exp(np.radians(turn)), np.zeros(20))

    straight = pose([0, 0, 0])
    assert oikonomidis_4.palm_turned(pose([0, 180, 0]), straight) == pytest.approx(180, abs=1e-4)
    assert oikonomidis_4.palm_turned(pose([0, 0, 170]), straight) == pytest.approx(0, abs=1e-4)
    assert oikonomidis_4.palm_turned(pose([70, 0, 0]), straight) == pytest.approx(70)


def test_a_worker_of_another_version_refuses() -> None:
    cell = full_cell(load_experiment("oikonomidis-2b"), cells_of("oikonomidis-2b")[0])
    with pytest.raises(InputError, match=r"depthtrack .*, the sweep needs 0\.0\.7"):
        measure_cell(cell | {"version": "0.0.7"})


# How it is summarised: against cases worked out by hand


def row(error: float, **values: Any) -> Row:
    measured = {"error_mm": error, "median_frame_mm": error / 2, "p95_frame_mm": 2 * error, "angle_error_deg": 3.0}
    return following.DEFAULTS | {"repetition": 0} | measured | {"ms_per_frame": 20.0} | values


def said(name: str, rows: list[Row]) -> dict[str, float | None]:
    return {each.what: each.ours for each in load_experiment(name).compare(rows)}


def test_the_error_is_the_median_over_repetitions() -> None:
    rows = [row(error, distance_m=0.5) for error in (9, 1, 2)] + [row(error, distance_m=2.5) for error in (6, 8)]
    near, far = load_experiment("oikonomidis-2b").tabulate(rows)
    assert near == {
        "distance_m": 0.5,
        "repetitions": 3,
        "error_mm": 2,
        "lowest_mm": 1,
        "highest_mm": 9,
        "median_frame_mm": 1,
        "p95_frame_mm": 4,
        "angle_error_deg": 3,
        "ms_per_frame": 20,
    }
    assert (far["error_mm"], far["lowest_mm"], far["highest_mm"]) == (7, 6, 8)
    assert said("oikonomidis-2b", rows) == {"error at 0.5 m": 2, "error at 2.5 m": 7}
    assert said("oikonomidis-2b", rows[:3])["error at 2.5 m"] is None


def test_gains_beyond_the_retained_budget() -> None:
    errors = {(16, 50): 2.0, (64, 10): 9.0, (64, 25): 5.0, (64, 50): 4.8, (128, 25): 4.6, (256, 10): 1.0}
    rows = [row(error, particles=p, generations=g) for (p, g), error in errors.items()]
    retained, gain, speed = said("oikonomidis-2a", rows).values()
    assert (retained, speed) == (5.0, 50.0)
    assert gain == pytest.approx(0.4)
    assert list(said("oikonomidis-2a", rows[:2]).values()) == [None, None, None]


def test_noise_and_viewpoints() -> None:
    noisy = [
        row(4, depth_noise_mm=0.0),
        row(6, depth_noise_mm=0.0, skin_flips_percent=40.0),
        row(30, depth_noise_mm=80.0),
    ]
    assert list(said("oikonomidis-2c", noisy).values()) == [4, 30]
    around = [row(error, viewpoint=viewpoint) for viewpoint, error in enumerate((3, 5, 4, 4.5))]
    assert list(said("oikonomidis-2d", around).values()) == [2, 5]


def starts(*errors: float, mirrored: int = 0) -> list[Row]:
    """The last few are mirrored."""
    n = len(errors)
    return [{"error_mm": error, "mirrored": i >= n - mirrored, "ms": 500.0} for i, error in enumerate(errors)]


def test_the_histogram_of_starts() -> None:
    rows = starts(0.0, 2.4, 2.5, 40.0, 40.1, 82.0, 120.0, 999.0, mirrored=3)
    table = load_experiment("oikonomidis-4").tabulate(rows)
    filled = {
        line["from_mm"]: (line["share_percent"], line["mirrored_percent"]) for line in table if line["share_percent"]
    }
    assert filled == {0: (25, 0), 2.5: (12.5, 0), 40: (25, 0), 80: (12.5, 12.5), 120: (25, 25)}
    assert table[0]["to_mm"] == 2.5
    assert table[-1]["to_mm"] is None
    assert list(said("oikonomidis-4", rows).values()) == [50.0, 37.5, pytest.approx(40.05), 0.5]


# Where it is written


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_an_experiment_from_cells_to_files(name: str, tmp_path: Path) -> None:
    experiment = load_experiment(name)
    few = Experiment(**(vars(experiment) | {"cells": lambda options: experiment.cells(options)[:3]}))
    # The first sign is held within 30 frames.
    options = replace(TINY, frames=30) if name == "schroeder-11" else TINY
    done = reproduce(few, options, tmp_path, InThisProcess())
    rows = [json.loads(line) for line in (tmp_path / "rows.jsonl").read_text().splitlines()]
    assert len(rows) == done.cells == len(few.cells(options))
    assert len({tuple(row) for row in rows}) == 1
    assert {"figure", "version", "error_mm", "seconds"} < set(rows[0])
    assert done.cell_seconds == pytest.approx(sum(row["seconds"] for row in rows), abs=1e-3)
    assert json.loads((tmp_path / "summary.json").read_text()) == json.loads(json.dumps(done.to_json()))
    with (tmp_path / "table.csv").open() as file:
        table = list(csv.DictReader(file))
    assert [{k: str("" if v is None else v) for k, v in line.items()} for line in done.table] == table
    picture = cv2.imread(str(tmp_path / "figure.png"))
    assert picture is not None
    assert min(picture.shape[:2]) > 600
    ours = np.all(np.abs(picture.astype(int) - (0xB2, 0x72, 0x00)) < 12, axis=-1)
    assert ours.sum() > 60
    assert sorted(path.name for path in tmp_path.iterdir()) == ["figure.png", "rows.jsonl", "summary.json", "table.csv"]


def test_processes_give_the_same_bits_and_a_cut_sweep_goes_on(tmp_path: Path) -> None:
    experiment = load_experiment("oikonomidis-2b")
    serial = reproduce(experiment, TINY, tmp_path / "serial", InThisProcess())
    cut = tmp_path / "cut"
    cut.mkdir()
    (cut / "rows.jsonl").write_bytes((tmp_path / "serial" / "rows.jsonl").read_bytes()[:900])
    watched: list[tuple[int, int]] = []

    def watch(rows: Any, total: int, before: int) -> Any:
        watched.append((total, before))
        return rows

    shared = reproduce(experiment, TINY, cut, LocalWorkers(2), watch)
    assert watched == [(5, 1)]
    assert (serial.reused, shared.reused) == (0, 1)
    assert untimed(shared.table) == untimed(serial.table)
    read = [
        [json.loads(line) for line in (folder / "rows.jsonl").read_text().splitlines()]
        for folder in (cut, tmp_path / "serial")
    ]
    by_distance = [sorted(untimed(rows), key=lambda row: row["distance_m"]) for rows in read]
    assert by_distance[0] == by_distance[1]


def test_figures_by_name() -> None:
    assert [each.name for each in chosen_experiments(["all"])] == list(EXPERIMENTS)
    assert [each.name for each in chosen_experiments(["fig4", "oikonomidis-2a", "oikonomidis-4"])] == [
        "oikonomidis-4",
        "oikonomidis-2a",
    ]
    assert SHORT_NAMES["fig2c"] == "oikonomidis-2c"
    assert (SHORT_NAMES["fig8"], SHORT_NAMES["sec6c"]) == ("schroeder-8", "schroeder-sec6c")
    assert len(SHORT_NAMES) == len(EXPERIMENTS)
    assert [each.name for each in chosen_experiments(["oikonomidis", "fig2a"])] == SWARM
    with pytest.raises(InputError, match=r"no figure 'fig5'.*oikonomidis, schroeder.*fig2a \(oikonomidis-2a\)"):
        chosen_experiments(["fig5"])


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tiny = ["--quick", "--repetitions", "1", "--resolution", "32", "--frames", "1", "--jobs", "1", "-o", str(tmp_path)]
    assert main(["reproduce", "fig2b", *tiny, "--json"]) == 0
    (summary,) = json.loads(capsys.readouterr().out)
    assert summary == json.loads((tmp_path / "oikonomidis-2b" / "summary.json").read_text())
    assert summary["options"]["frames"] == 1
    assert [line["distance_m"] for line in summary["table"]] == [0.5, 1.0, 1.5, 2.0, 2.5]
    assert main(["reproduce", "oikonomidis-2b", *tiny]) == 0
    text = capsys.readouterr().out
    assert "5 cells, 5 of them from before" in text
    assert "at most 7.5 mm" in text
    assert f"{summary['comparisons'][1]['ours']:.3g} mm" in text


def test_the_command_lists_and_refuses(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reproduce", "list"]) == 0
    assert "oikonomidis-2a   800 cells  Error against particles and generations" in capsys.readouterr().out
    for arguments, hint in (
        (["fig2b"], "-o DIR"),
        (["-o", str(tmp_path)], "name the figures"),
        (["fig99", "-o", str(tmp_path)], "no figure 'fig99'"),
        (["fig2b", "-o", str(tmp_path), "--jobs", "0"], "--jobs"),
        (["fig2b", "-o", str(tmp_path), "--frames", "0", "--jobs", "1"], "1 to 360 frames"),
    ):
        assert main(["reproduce", *arguments]) == 2
        assert hint in capsys.readouterr().err
