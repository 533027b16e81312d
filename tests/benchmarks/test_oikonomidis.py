"""Test the experiments of Oikonomidis et al. 2011: cells, measurements, tables."""

import json
from typing import Any

import numpy as np
import pytest

from depthtrack.benchmarks.papers import oikonomidis, oikonomidis_4
from depthtrack.benchmarks.papers.experiment import ExperimentOptions
from depthtrack.benchmarks.papers.registry import (
    EXPERIMENTS,
    load_experiment,
)
from depthtrack.errors import InputError
from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.geometry.rotations import quaternion_exp
from depthtrack.hand.pose import make_pose

TINY = ExperimentOptions(quick=True, repetitions=1, resolution=32, frames=2)
TIMES = ("seconds", "ms_per_frame", "ms")
SWARM = [name for name in EXPERIMENTS if name.startswith("oikonomidis-")]


def untimed(rows: list[Row]) -> list[Row]:
    return [{name: value for name, value in row.items() if name not in TIMES} for row in rows]


def cells_of(name: str, **options: Any) -> list[Cell]:
    return load_experiment(name).cells(ExperimentOptions(**options))


# Cells


def test_the_cells_are_those_of_the_paper() -> None:
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
def test_the_quick_version_is_coarser_and_options_reach_the_cells(name: str) -> None:
    quick = cells_of(name, quick=True)
    assert len(quick) <= len(cells_of(name)) / 4
    assert {cell["resolution"] for cell in quick} == {96}
    chosen = cells_of(name, quick=True, variant="paper", renderer="osmesa", resolution=50, repetitions=2)
    assert {(cell["variant"], cell["renderer"], cell["resolution"], cell["repetition"]) for cell in chosen} == {
        ("paper", "osmesa", 50, repetition) for repetition in (0, 1)
    }
    for repetitions in (0, -1, 10**9):
        with pytest.raises(InputError, match=r"--repetitions must be from 1 to 10000"):
            cells_of(name, repetitions=repetitions)


# Measurements


def tracked(**changes: Any) -> Row:
    (cell,) = oikonomidis.cells(TINY, [changes])
    return oikonomidis.track_motion(**(cell | {"frames": 4} | changes))


def test_tracking_is_repeatable_and_accurate() -> None:
    row = tracked(resolution=96)
    assert 0.05 < row["error_mm"] < 4
    assert row["median_frame_mm"] <= row["p95_frame_mm"]
    assert untimed([tracked(resolution=96)]) == untimed([row])
    assert tracked(resolution=96, repetition=1)["error_mm"] != row["error_mm"]
    assert tracked(resolution=96, variant="paper")["error_mm"] != row["error_mm"]


def test_noise_and_a_tiny_budget_increase_the_error(monkeypatch: pytest.MonkeyPatch) -> None:
    # A search would fail here, so the swarm tracks alone at any energy.
    monkeypatch.setattr("depthtrack.tracking.stages.searches.global_proposals", None)
    good = tracked()["error_mm"]
    assert tracked(depth_noise_mm=80.0, skin_flips_percent=40.0)["error_mm"] > 1.5 * good
    assert tracked(particles=4, generations=1)["error_mm"] > 1.5 * good


def test_the_error_of_a_single_frame_estimate() -> None:
    (cell, *_) = cells_of("oikonomidis-4", quick=True, repetitions=1, resolution=48)
    row = oikonomidis_4.measure(**cell)
    assert row["status"] == "started"
    assert 0.5 < row["error_mm"] < 15
    assert 0 < row["palm_turned_deg"] < 25
    assert row["mirrored"] is False


def test_the_angle_between_palms() -> None:
    def pose(rotation: list[float]) -> np.ndarray:
        return make_pose(np.zeros(3), quaternion_exp(np.radians(rotation)), np.zeros(20))

    straight = pose([0, 0, 0])
    assert oikonomidis_4.palm_angle(pose([0, 180, 0]), straight) == pytest.approx(180, abs=1e-4)
    assert oikonomidis_4.palm_angle(pose([0, 0, 170]), straight) == pytest.approx(0, abs=1e-4)
    assert oikonomidis_4.palm_angle(pose([70, 0, 0]), straight) == pytest.approx(70)


# Tables, compared with cases computed by hand


def row(error: float, **values: Any) -> Row:
    measured = {"error_mm": error, "median_frame_mm": error / 2, "p95_frame_mm": 2 * error, "angle_error_deg": 3.0}
    return oikonomidis.DEFAULTS | {"repetition": 0} | measured | {"ms_per_frame": 20.0} | values


def compared(name: str, rows: list[Row]) -> dict[str, float | None]:
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
    assert compared("oikonomidis-2b", rows) == {"error at 0.5 m": 2, "error at 2.5 m": 7}
    assert compared("oikonomidis-2b", rows[:3])["error at 2.5 m"] is None


def test_the_gain_of_a_larger_budget() -> None:
    errors = {(16, 50): 2.0, (64, 10): 9.0, (64, 25): 5.0, (64, 50): 4.8, (128, 25): 4.6, (256, 10): 1.0}
    rows = [row(error, particles=p, generations=g) for (p, g), error in errors.items()]
    retained, gain, speed = compared("oikonomidis-2a", rows).values()
    assert (retained, speed) == (5.0, 50.0)
    assert gain == pytest.approx(0.4)
    assert list(compared("oikonomidis-2a", rows[:2]).values()) == [None, None, None]


def test_errors_over_noise_and_viewpoints() -> None:
    noisy = [
        row(4, depth_noise_mm=0.0),
        row(6, depth_noise_mm=0.0, skin_flips_percent=40.0),
        row(30, depth_noise_mm=80.0),
    ]
    assert list(compared("oikonomidis-2c", noisy).values()) == [4, 30]
    around = [row(error, viewpoint=viewpoint) for viewpoint, error in enumerate((3, 5, 4, 4.5))]
    assert list(compared("oikonomidis-2d", around).values()) == [2, 5]


def starts(*errors: float, mirrored: int = 0) -> list[Row]:
    """Return estimates with these errors; the last `mirrored` ones are mirrored."""
    n = len(errors)
    return [{"error_mm": error, "mirrored": i >= n - mirrored, "ms": 500.0} for i, error in enumerate(errors)]


def test_the_histogram_of_errors() -> None:
    rows = starts(0.0, 2.4, 2.5, 40.0, 40.1, 82.0, 120.0, 999.0, mirrored=3)
    table = load_experiment("oikonomidis-4").tabulate(rows)
    filled = {
        line["from_mm"]: (line["share_percent"], line["mirrored_percent"]) for line in table if line["share_percent"]
    }
    assert filled == {0: (25, 0), 2.5: (12.5, 0), 40: (25, 0), 80: (12.5, 12.5), 120: (25, 25)}
    assert table[0]["to_mm"] == 2.5
    assert table[-1]["to_mm"] is None
    assert list(compared("oikonomidis-4", rows).values()) == [50.0, 37.5, pytest.approx(40.05), 0.5]
