"""The errors of baselines on held-out stretches scale the expected errors."""

import numpy as np
import pytest

from depthtrack.markers.filled_capture import Gap
from depthtrack.markers.filling.expected_error import error_after
from depthtrack.markers.filling.fill import fill_gaps
from depthtrack.markers.filling.held_out import error_scale
from depthtrack.markers.filling.options import FillOptions
from depthtrack.types import Array
from tests.markers.filling.captures import cut, hand, labelled, poses

RATE = 100.0


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_errors_larger_than_predicted_give_a_larger_scale(factor: float) -> None:
    still = np.zeros((400, 2, 3))
    given = still.copy()
    given[100:120, 0] = np.nan

    def fill(measured: list[Array], gaps: list[list[Gap]]) -> list[Array]:
        out = np.full(still.shape, np.nan)
        for gap in gaps[0]:
            time = np.minimum(np.arange(1, gap.length + 1), np.arange(gap.length, 0, -1)) / RATE
            out[gap.start : gap.stop, gap.marker] = 0.0
            out[gap.start : gap.stop, gap.marker, 0] = factor * error_after("spline", time)
        return [out]

    scale = error_scale(fill, "spline", [given], [[Gap(0, 0, 100, 120)]], RATE)
    # One stretch, and the prediction as another one.
    assert scale == pytest.approx(np.sqrt((1 + factor**2) / 2))


def test_nothing_held_out_leaves_the_prediction() -> None:
    given = np.full((30, 1, 3), np.nan)
    given[[0, 29]] = 0.0
    assert error_scale(lambda measured, gaps: measured, "pca", [given], [[Gap(0, 0, 1, 29)]], RATE) == 1.0
    assert error_scale(lambda measured, gaps: measured, "pca", [given], [[]], RATE) == 1.0


def test_a_calmer_hand_has_smaller_expected_errors() -> None:
    whole = hand().positions(poses())
    slow = hand().positions(np.repeat(poses(100), 4, axis=0))
    stated = []
    for positions in (whole, slow):
        given = labelled(
            cut(positions, *((label, 100, 140) for label in ("index_tip", "ring_tip", "thumb_tip"))), poses()
        )
        filled = fill_gaps(given, FillOptions(method="pattern"))
        stated.append(np.nanmean(filled.expected_error[0]))
    assert stated[1] < stated[0]
