"""Test the experiments of Schroeder et al. 2014: cells, measurements, tables."""

import json
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

from depthtrack.benchmarks.papers import schroeder, schroeder_7, schroeder_11
from depthtrack.benchmarks.papers.experiment import ExperimentOptions
from depthtrack.benchmarks.papers.registry import EXPERIMENTS, load_experiment
from depthtrack.benchmarks.papers.synergy_sources import load_source, motion_postures, resolve_name, short_label
from depthtrack.errors import InputError
from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.hand.pose import ANGLE_NAMES
from depthtrack.hand.synergies import load_synergies, save_synergies

FITTING = [name for name in EXPERIMENTS if name.startswith("schroeder-")]


def cells_of(name: str, **options: Any) -> list[Cell]:
    return load_experiment(name).cells(ExperimentOptions(**options))


def compared(name: str, rows: list[Row]) -> dict[str, float | None]:
    return {each.what: each.ours for each in load_experiment(name).compare(rows)}


def write_postures(path: Path, angles: np.ndarray) -> Path:
    np.savetxt(path, angles, delimiter=",", header=",".join(ANGLE_NAMES), comments="")
    return path


# Synergies by name


def test_synergies_of_a_set_a_motion_a_file_and_recorded_postures(tmp_path: Path) -> None:
    leap, signs = load_source("leap"), load_source("signs")
    np.testing.assert_array_equal(leap.synergies.components, load_synergies("leap").components)
    assert leap.postures is None
    assert signs.postures is not None
    assert signs.postures.shape == (675, 20)
    coefficients = signs.synergies.project(signs.postures)
    np.testing.assert_allclose(coefficients.var(axis=0), signs.synergies.variances, atol=1e-12)
    save_synergies(signs.synergies.truncated(7), tmp_path / "mine.json")
    assert len(load_source(str(tmp_path / "mine.json")).synergies) == 7
    recorded = load_source(str(write_postures(tmp_path / "mine.csv", signs.postures[::5])))
    assert recorded.postures is not None
    np.testing.assert_allclose(recorded.postures, signs.postures[::5])


def test_a_resolved_name_has_an_absolute_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    save_synergies(load_synergies("leap-grasps"), tmp_path / "mine.json")
    monkeypatch.chdir(tmp_path)
    assert resolve_name("mine.json", "leap") == str(tmp_path / "mine.json")
    assert resolve_name(None, "leap") == "leap"
    (tmp_path / "signs").mkdir()
    assert resolve_name("signs", "leap") == "signs"
    with pytest.raises(InputError, match=r"no synergies 'nonsense': give a set \(leap, leap-grasps\)"):
        resolve_name("nonsense", "leap")


# Cells


def test_the_cells_are_those_of_the_paper() -> None:
    assert [cell["icp_iterations"] for cell in cells_of("schroeder-8")] == list(range(1, 11))
    assert {cell["subsampling"] for cell in cells_of("schroeder-8")} == {3}
    assert [cell["subsampling"] for cell in cells_of("schroeder-9")] == list(range(1, 11))
    assert {cell["icp_iterations"] for cell in cells_of("schroeder-9")} == {5}
    full, *reduced = cells_of("schroeder-10")
    assert (full["motion"], full["synergies"], full["components"]) == ("grasp", None, None)
    assert [(cell["synergies"], cell["soft"]) for cell in reduced] == [
        (name, soft) for name in ("other-grasps", "grasp") for soft in (False, True, False)
    ]
    assert not any(cell["soft"] for cell in cells_of("schroeder-10", variant="paper"))
    for cell, share in zip(reduced, (0.99, 0.99, 0.998) * 2, strict=True):
        synergies, count = load_source(cell["synergies"]).synergies, cell["components"]
        assert synergies.variance_share(count - 1) < share <= synergies.variance_share(count)
    spaces = {(cell["model"], cell["synergies"], cell["components"]) for cell in cells_of("schroeder-sec6c")}
    assert {(model, None, None) for model in ("skin", "cylinders")} < spaces
    assert {(model, name, 6) for model in ("skin", "cylinders") for name in ("everyday", "leap")} < spaces
    assert {cell["components"] for cell in cells_of("schroeder-7")} == set(range(1, 21))
    signs = cells_of("schroeder-11")
    assert {cell["sign"] for cell in signs} == set(range(30))
    for way, name, times in (
        ("hierarchical", "signs", 5),
        ("hierarchical", schroeder_11.OTHERS, 5),
        ("all angles at once", "signs", 1),
    ):
        mine = [cell for cell in signs if (cell["way"], cell["synergies"], cell["sign"]) == (way, name, 3)]
        assert [cell["repetition"] for cell in mine] == list(range(times))
    with pytest.raises(InputError, match="contain no sign"):
        cells_of("schroeder-11", frames=3)


@pytest.mark.parametrize("name", FITTING)
def test_the_quick_version_is_coarser_and_options_reach_the_cells(name: str, tmp_path: Path) -> None:
    full, quick = cells_of(name), cells_of(name, quick=True)
    assert 0 < len(quick) <= len(full)
    assert {tuple(cell) for cell in [*full, *quick]} == {tuple(full[0])}
    assert len({json.dumps(cell) for cell in full}) == len(full)
    assert all(json.loads(json.dumps(cell)) == cell for cell in full)
    chosen = cells_of(name, variant="paper", frames=30)
    assert {(cell.get("variant", "paper"), cell.get("frames", 30)) for cell in chosen} == {("paper", 30)}
    if any(cell["synergies"] for cell in full):
        own = write_postures(tmp_path / "own.csv", motion_postures("everyday")[::20])
        used = {cell["synergies"] for cell in cells_of(name, synergies=str(own))}
        assert str(own) in used <= {None, str(own), "grasp"}


# Measurements


def tracked(**changes: Any) -> Row:
    (cell,) = schroeder.cells(ExperimentOptions(frames=6), [changes])
    return schroeder.track_motion(**cell)


def test_tracking_is_repeatable_and_accurate() -> None:
    row, again = tracked(), tracked()
    assert 0 < row["error_deg"] < 1
    assert 0 < row["error_mm"] < 1
    assert row["error_deg"] == pytest.approx(np.mean(row["frame_errors_deg"]), abs=1e-3)
    assert len(row["frame_errors_deg"]) == 6
    assert row["ms_per_frame"] > 0
    assert {**row, "ms_per_frame": 0} == {**again, "ms_per_frame": 0}
    assert tracked(subsampling=6)["points"] == pytest.approx(row["points"] / 2, abs=1)
    assert tracked(icp_iterations=1)["error_deg"] != row["error_deg"]


def test_model_and_synergies_of_the_cell_are_used() -> None:
    assert 0 < tracked(model="cylinders")["error_deg"] < 4
    # One synergy is not enough for the postures of the motion.
    assert tracked(synergies="leap", components=1)["error_deg"] > 3 * tracked()["error_deg"]
    assert tracked(synergies="everyday", components=12)["error_deg"] < 1.5


@pytest.mark.parametrize(("variant", "highest_deg"), [("default", 0.5), ("paper", 4)])
def test_a_sign_is_estimated_from_a_single_frame(variant: Literal["default", "paper"], highest_deg: float) -> None:
    """The sign needs the hierarchy."""

    def row(way: schroeder_11.Way, synergies: str = "signs") -> Row:
        return schroeder_11.measure(sign=19, way=way, synergies=synergies, variant=variant, repetition=0)

    found, again, flat = row("hierarchical"), row("hierarchical"), row("all angles at once")
    assert 0 < found["error_deg"] < highest_deg < flat["error_deg"]
    assert 0 < found["error_mm"] < flat["error_mm"]
    assert {**found, "s_per_frame": 0} == {**again, "s_per_frame": 0}
    assert row("hierarchical", schroeder_11.OTHERS)["error_deg"] not in (found["error_deg"], flat["error_deg"])


def test_static_intervals_of_poses() -> None:
    poses = np.zeros((30, 27))
    poses[:, 9] = np.concatenate([np.zeros(6), np.linspace(0.1, 1, 10), np.ones(9), [2, 3, 3, 3, 4]])
    assert schroeder_11.static_intervals(poses) == [(0, 5), (15, 24)]


def test_more_components_approximate_postures_better() -> None:
    rows = [schroeder_7.measure(synergies="signs", postures="signs", components=n) for n in (1, 4, 12, 20)]
    errors = [row["error_deg"] for row in rows]
    assert errors == sorted(errors, reverse=True)
    assert errors[0] > 10
    assert errors[-1] < 1e-6
    assert rows[-1]["error_mm"] < 1e-6
    assert rows[0]["particular_deg"] > rows[0]["error_deg"]
    assert rows[-1]["variance_percent"] == pytest.approx(100)


def test_an_approximation_is_the_projection_onto_the_components(tmp_path: Path) -> None:
    """One component keeps the wider of two directions, so the error follows by hand."""
    wide, narrow = np.eye(20)[5], np.eye(20)[9]
    angles = np.radians([30 * wide, -30 * wide, 8 * narrow, -8 * narrow])
    row = schroeder_7.measure(synergies=str(write_postures(tmp_path / "few.csv", angles)), postures=None, components=1)
    assert row["error_deg"] == pytest.approx(2 * 8 / 20 / 4)
    assert row["particular_deg"] == pytest.approx(0, abs=1e-9)
    assert row["variance_percent"] == pytest.approx(100 * 900 / 964)


# Tables, compared with cases computed by hand


def row(error: float, **values: Any) -> Row:
    measured = dict.fromkeys(schroeder.MEASURED, 0.0) | {"error_deg": error, "error_mm": 2 * error}
    return schroeder.DEFAULTS | measured | {"ms_per_frame": 5.0, "frame_errors_deg": [error]} | values


def test_figures_of_iterations_and_subsampling() -> None:
    rows = [row(error, icp_iterations=n, ms_per_frame=n + 1.0) for n, error in ((1, 8.0), (5, 2.0), (10, 1.5))]
    assert list(compared("schroeder-8", rows).values()) == [2.0, 0.25, 4.0, 6.0, pytest.approx(11 / 6)]
    assert list(compared("schroeder-8", rows[:1]).values()) == [None] * 5
    rows = [row(3.0, subsampling=10), row(1.0, ms_per_frame=4.0)]
    assert list(compared("schroeder-9", rows).values()) == [1.0, 3.0, 2.0, 4.0, 250.0]


def test_figures_of_grasps_with_all_angles_and_with_synergies() -> None:
    rows = [
        row(12.0),
        row(4.0, synergies="other-grasps", components=5, ms_per_frame=4.0),
        row(3.0, synergies="other-grasps", components=5, soft=True),
        row(3.5, synergies="other-grasps", components=8),
        row(2.0, synergies="grasp", components=3),
    ]
    assert list(compared("schroeder-10", rows).values()) == [12.0, 4.0, 3.5, 2.0, 3.0, 5.0, 24.0, 8.0, 200.0, 250.0]
    assert compared("schroeder-10", rows[:1])["synergies of other grasps alone"] is None


def test_figures_of_signs_by_method_and_synergies() -> None:
    def row(way: str, synergies: str, error: float) -> Row:
        return {
            "way": way,
            "synergies": synergies,
            "sign": 0,
            "error_deg": error,
            "error_mm": 2 * error,
            "s_per_frame": 0.1,
        }

    rows = [row("hierarchical", "signs", error) for error in (0.2, 0.3, 1.6)]
    rows += [row("hierarchical", schroeder_11.OTHERS, 2.0), row("all angles at once", "signs", 9.0)]
    assert list(compared("schroeder-11", rows).values()) == [
        pytest.approx(0.7),
        9,
        0.1,
        pytest.approx(1.4),
        2,
        0.3,
        1.6,
    ]
    first = load_experiment("schroeder-11").tabulate(rows)[0]
    assert (first["estimates"], first["within_1_deg_percent"]) == (3, pytest.approx(200 / 3))


def test_figures_of_cylinders_and_mesh() -> None:
    rows = [
        row(error, model=model, synergies=name, components=count)
        for (name, count), errors in {(None, None): (2, 4), ("everyday", 6): (3, 3.5), ("leap", 6): (8, 9)}.items()
        for model, error in zip(("skin", "cylinders"), errors, strict=True)
    ]
    assert [each.ours for each in load_experiment("schroeder-sec6c").compare(rows)] == [
        2,
        4,
        4,
        8,
        3,
        3.5,
        8,
        9,
        200,
        200,
    ]


def test_figures_of_the_variance() -> None:
    measured = {"error_deg": 5.0, "particular_deg": 6.0, "p95_deg": 9.0, "error_mm": 4.0}
    rows = [
        {"synergies": name, "postures": "grasp", "components": n, "variance_percent": 10.0 * n} | measured
        for name, n in (("leap", 3), ("leap", 6), ("leap-grasps", 3))
    ]
    found = compared("schroeder-7", rows)
    assert found["variance in the first 3 of leap"] == 30.0
    assert found["variance in the first 6 of leap"] == 60.0
    assert found["variance in the first 2 of leap-grasps"] is None
    assert found["mean error of grasp, 6 of leap"] == 5.0
    mine = [row | {"synergies": "/data/mine.csv", "postures": None} for row in rows[:2]]
    assert list(compared("schroeder-7", mine).values()) == [None, 30.0, 60.0, 5.0]
    assert "mean error of its postures, 6 of mine" in compared("schroeder-7", mine)
    assert short_label("/data/a-name-that-has-no-end.csv") == "a-name-that-h..."
