"""Test the experiment of Maycock et al. 2015: cells, a short trial, comparison, picture."""

import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from depthtrack.benchmarks.papers.experiment import ExperimentOptions
from depthtrack.benchmarks.papers.maycock_6 import EXPERIMENT, label_trial
from depthtrack.benchmarks.papers.registry import chosen_experiments
from depthtrack.evaluation.sweep.rows import Row


def rows(*errors: float) -> list[Row]:
    shared = {"seen_deg": 0.0, "lost_frames": 0, "right_labels": 1.0, "hertz": 3000.0}
    trials = [{"scene": "hand", "motion": "grasp", "seed": n, "error_deg": e} | shared for n, e in enumerate(errors)]
    return [*trials, {"scene": "scene", "motion": "grasp", "seed": 0, "error_deg": 9.0} | shared | {"hertz": 900.0}]


def test_it_is_found_with_and_without_its_dash() -> None:
    assert [each.name for each in chosen_experiments(["maycock6", "maycock-6", "fig6", "maycock"])] == ["maycock-6"]


def test_reported_trials_have_seeds_above_those_of_tuning() -> None:
    cells = EXPERIMENT.cells(ExperimentOptions())
    assert sum(cell["scene"] == "hand" for cell in cells) == 200
    assert min(cell["seed"] for cell in cells) == 1000
    assert all(cell["frames"] == 1000 for cell in cells)
    tuning = EXPERIMENT.cells(ExperimentOptions(split="tuning", quick=True))
    assert max(cell["seed"] for cell in tuning) < 100


@pytest.mark.parametrize("variant", ["default", "paper"])
def test_a_trial_is_labelled_as_the_truth(variant: str) -> None:
    row = label_trial(scene="hand", motion="grasp", seed=3, frames=60, variant=variant)  # type: ignore[arg-type]
    assert row["right_labels"] > 0.98
    assert row["error_deg"] < 0.5
    assert row["hertz"] > 0


def test_figures_stand_beside_those_of_the_paper() -> None:
    compared = {each.what: each for each in EXPERIMENT.compare(rows(0.0, 0.2))}
    assert compared["difference of angles, mean of the trials"].ours == pytest.approx(0.1)
    assert compared["standard deviation of the trials"].ours == pytest.approx(0.1)
    assert compared["standard deviation of the trials"].paper == "0.12 deg"
    assert compared["frames per second, two hands and three rigid bodies"].ours == 900.0
    assert len(EXPERIMENT.tabulate(rows(0.0, 0.2))) == 3


def test_equal_angles_can_be_drawn() -> None:
    axes = Figure().add_subplot()
    EXPERIMENT.draw(axes, rows(0.0, 0.0, 0.3))
    bars = [patch for patch in axes.patches if isinstance(patch, Rectangle)]
    assert sum(bar.get_height() for bar in bars) == 3
