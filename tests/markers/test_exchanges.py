"""Markers that were swapped after a common gap are swapped back; others keep their labels."""

from dataclasses import replace

import numpy as np
import pytest

from depthtrack.markers.exchanges import exchange_markers
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.labelled_fit import fit_poses
from depthtrack.synthesis.marker_capture import MarkerSynthesis, synthesise_markers
from depthtrack.synthesis.marker_measurement import MeasurementErrors

CLEAN = MeasurementErrors(dropouts=0.0, ghosts=0)


@pytest.fixture(scope="module")
def truth() -> LabelledCapture:
    """A grasp with its true labels, and the poses that fit them."""
    made = synthesise_markers(MarkerSynthesis(motion="grasp", layout="13", frames=200, errors=CLEAN, seed=3))
    return fit_poses(made.truth)


def swapped(truth: LabelledCapture, first: int, gap: int) -> LabelledCapture:
    """Return the capture with ring and middle tip missing for a while, and exchanged after it."""
    columns = truth.columns[0].copy()
    pair = [truth.models[0].labels.index(label) for label in ("ring_tip", "middle_tip")]
    columns[first + gap :, pair] = columns[first + gap :, pair[::-1]]
    columns[first : first + gap, pair] = -1
    return fit_poses(replace(truth, columns=(columns,)))


def test_markers_exchanged_after_a_common_gap_are_exchanged_back(truth: LabelledCapture) -> None:
    wrong = swapped(truth, 60, 20)
    assert (wrong.columns[0] != truth.columns[0])[80:].any()
    mended = exchange_markers(wrong)
    np.testing.assert_array_equal(mended.columns[0][80:], truth.columns[0][80:])
    assert np.nanmax(fit_poses(mended).residuals(0)[80:]) < np.nanmax(wrong.residuals(0)[80:])


def test_right_labels_stay(truth: LabelledCapture) -> None:
    assert exchange_markers(truth) is truth
