"""Figures of Schroeder et al. 2015 on made-up rows: cells, comparisons and plots."""

from typing import Any

import pytest

from depthtrack.benchmarks.papers.experiment import ExperimentOptions
from depthtrack.benchmarks.papers.plot import draw_png
from depthtrack.benchmarks.papers.registry import load_experiment
from depthtrack.benchmarks.papers.schroeder2015 import TEST, TRAINING
from depthtrack.benchmarks.papers.schroeder2015_11 import fewest_below

QUICK = ExperimentOptions(quick=True, repetitions=1)


def rows_of(name: str, options: ExperimentOptions = QUICK) -> list[dict[str, Any]]:
    """Return the cells of an experiment with errors that fall with the number of markers."""
    rows: list[dict[str, Any]] = []
    for cell in load_experiment(name).cells(options):
        count = cell.get("markers", 4)
        worse = 3 if cell.get("choice") in ("all", "one", "three") or cell.get("kind") == "generic" else 1
        made = {"error_mm": worse * 8 / count, "largest_mm": 30.0, "markers": count}
        made |= {"swarm": 7.0, "seeded": 5.0, "found": 4.0, "greedy": 6.0, "next": 8.0, "least": 4.5, "reached": 0.5}
        made |= {"swarm_s": 1.0, "seeded_s": 1.2, "found_s": 0.1, "greedy_s": 0.3, "next_s": 3.0}
        made |= {
            "overtakes_s": 0.5,
            "whole_s": 2.0,
            "whole_layouts": 30_000,
            "next_layouts": 90_000,
            "swarm_curve": [[0.1, 9.0], [1.0, 5.0]],
            "greedy_curve": [[0.1, 8.0], [2.0, 6.0]],
        }
        made |= {f"{method}_ms": count / 100 for method in ("subspace", "prior", "plain")}
        rows.append(made | cell)
    return rows


def compared(name: str) -> dict[str, float | None]:
    return {line.what: line.ours for line in load_experiment(name).compare(rows_of(name))}


def test_test_motions_are_never_among_the_training_data() -> None:
    assert all(test not in TRAINING[training] for training, test in TEST.items())
    assert not {"grasp", "other-grasps"} & set(TRAINING["generic"])


def test_the_swarm_is_compared_with_the_greedy_choice() -> None:
    found = compared("schroeder2015-9")
    assert found["swarm, exchanges, changes: below greedy"] == 100
    assert found["swarm, exchanges, changes: above greedy"] == 0
    assert found["the paper's swarm: above greedy"] == 100
    assert found["swarm reaches greedy's energy sooner"] == 100
    assert found["sooner than with sums and bounds"] == 0
    assert found["swarm, 1000 x 100, one core"] == 1.0


def test_the_fewest_markers_below_two_millimetres() -> None:
    assert fewest_below({4: 3.0, 6: 1.9, 8: 2.1, 10: 1.0}) == 10
    assert fewest_below({4: 1.0, 6: 0.5}) == 4
    assert fewest_below({4: 3.0}) is None
    found = compared("schroeder2015-11")
    assert found["specific layouts, free refinement: below 2 mm from"] == 6
    assert found["generic layouts, free refinement: below 2 mm from"] is None


def test_ours_is_compared_with_each_base_set() -> None:
    found = compared("schroeder2015-10")
    assert found["expected error, prior: below Wheatland, one a bone"] == 100
    assert found["paper's objective: Wheatland, all vertices, 6"] == 4.0


def test_centimetres_of_the_table() -> None:
    assert compared("schroeder2015-table1")["standard IK, average"] == 0.2
    assert compared("schroeder2015-14")["26 markers, prior"] == 0.26


@pytest.mark.parametrize("name", [f"schroeder2015-{tail}" for tail in ("9", "10", "11", "14", "table1")])
def test_figures_are_drawn(name: str) -> None:
    experiment, rows = load_experiment(name), rows_of(name)
    assert len(experiment.tabulate(rows)) == len(rows)
    assert draw_png(experiment, rows, experiment.compare(rows), "").startswith(b"\x89PNG")
