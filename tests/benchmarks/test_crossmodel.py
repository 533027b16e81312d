"""The cross-model benchmark: choice of recordings, measurement and table."""

from typing import Any

import numpy as np
import pytest

from depthtrack.benchmarks.crossmodel import evidence
from depthtrack.benchmarks.crossmodel import measure as measuring
from depthtrack.benchmarks.crossmodel.experiment import EXPERIMENT, compare, tabulate
from depthtrack.benchmarks.crossmodel.measure import _longest, measure
from depthtrack.benchmarks.crossmodel.recordings import MOTIONS, made_recording, recording_cells
from depthtrack.benchmarks.papers.experiment import ExperimentOptions
from depthtrack.benchmarks.papers.plot import draw_png
from depthtrack.calibration.calibrate import Calibration
from depthtrack.errors import InputError
from depthtrack.tracking.confidence import Evidence

TINY: dict[str, Any] = {
    "motion": "everyday",
    "seed": 3,
    "sensor": "kinect2",
    "side": "left",
    "scale": 1.0,
    "viewpoint": 0,
    "rig": None,
    "frames": 16,
}


def true_sizes(sequence: Any, *_: Any) -> Calibration:
    """Return the hand of the recording as its calibration."""
    nothing = np.zeros((0, 27))
    return Calibration(sequence.hand, {}, 0.5, 1.0, 1.0, (), nothing, nothing)


def test_cells_are_drawn_once_for_each_motion_and_seed() -> None:
    cells = recording_cells(ExperimentOptions(repetitions=3))
    assert len(cells) == 3 * len(MOTIONS)
    assert cells == recording_cells(ExperimentOptions(repetitions=3))
    assert {cell["side"] for cell in cells} == {"left", "right"}
    assert all(0.8 <= cell["scale"] <= 1.2 for cell in cells)
    assert cells[-6:] == recording_cells(ExperimentOptions(repetitions=1, first_seed=2))
    with pytest.raises(InputError, match="must be below 1000, found 1001"):
        recording_cells(ExperimentOptions(repetitions=2, first_seed=1000, split="tuning"))
    tuned = recording_cells(ExperimentOptions(repetitions=3, split="tuning"))
    assert not {cell["seed"] for cell in cells} & {cell["seed"] for cell in tuned}


def test_the_recording_of_a_cell_has_exact_truth() -> None:
    with made_recording(**TINY | {"frames": 2}) as sequence:
        assert len(sequence) == 2
        assert sequence.exact_depth(1) is not None
        assert sequence.ground_truth is not None
        assert sequence.hand is not None
        assert sequence.hand.side == "left"


@pytest.mark.slow
def test_a_known_hand_is_measured_without_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measuring, "calibrate_either_side", true_sizes)
    monkeypatch.setattr(measuring, "CORRECTED_WITHIN", 8)
    row = measure(**TINY)
    assert (row["side_right"], row["side_sure"], row["starts"], row["starts_right"]) == (True, True, 2, 2)
    assert (row["exchanged"], row["exchanged_corrected"]) == (2, 2)
    for name in measuring.TRACKERS:
        assert row[f"{name}_mean_mm"] < 3
        assert row[f"{name}_wrong_percent"] == 0
    figures = {each.what: each.ours for each in compare([row])}
    assert figures["right sides among those"] == 100
    assert figures["starts on the right branch"] == 100
    assert [line["tracker"] for line in tabulate([row])] == list(measuring.TRACKERS)
    picture = draw_png(EXPERIMENT, [row], compare([row]), "one recording")
    assert picture.startswith(b"\x89PNG")


@pytest.mark.slow
def test_the_evidence_of_a_mirrored_hand_is_worse(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(evidence, "calibrate", true_sizes)
    frames = evidence.measure_evidence(TINY | {"frames": 4})["tracked"]
    assert {frame[0] for frame in frames} == {"calibrated", "mirrored", "average"}
    assert {frame[1] for frame in frames} == set(measuring.TRACKERS)
    kinds = ("calibrated", "mirrored", "average")
    energy, largest = (dict[str, list[float]]({kind: [] for kind in kinds}) for _ in range(2))
    for kind, _, figures, error, shown, shown_within, hidden, hidden_within in frames:
        energy[kind].append(Evidence(*figures).energy)
        largest[kind].append(error)
        assert (shown + hidden, 0 <= shown_within <= shown, 0 <= hidden_within <= hidden) == (21, True, True)
    assert np.mean(energy["mirrored"]) > np.mean(energy["calibrated"])
    assert np.mean(largest["mirrored"]) > np.mean(largest["calibrated"])


def test_the_longest_wrong_branch_is_timed() -> None:
    wrong = np.array([False, True, True, False, True, True, True])
    assert _longest(wrong, np.arange(7) / 10) == pytest.approx(0.2)
    assert _longest(~wrong & wrong, np.arange(7) / 10) == 0
