"""Eq. (1) and (2) agree with cases counted by hand."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.errors import InputError
from depthtrack.hand.pose import ANGLE_NAMES
from depthtrack.rendering.objective import Terms, evaluate, finger_crossing
from depthtrack.rendering.options import Objective


def test_sums_of_a_hand_counted_image() -> None:
    # matched | seen, too far | only observed | only drawn | missing reading, drawn, in the silhouette | nothing
    silhouette = np.array([[True, True, True, False, True, False]])
    observed = np.array([[0.500, 0.500, 0.500, 0.000, 0.000, 0.0]])
    rendered = np.array([[0.506, 0.520, 0.000, 0.500, 0.500, 0.0]])
    clamped, matched_silhouette, union = evaluate(Objective(), silhouette, observed, rendered)
    assert clamped == pytest.approx(0.006 + 0.020 + 0.040 + 0.040 + 0.040)
    assert matched_silhouette == 2  # the first and the fifth
    assert union == 5  # four of the silhouette, and the drawn one where nothing was read


def test_energy_of_hand_counted_sums() -> None:
    pose = np.zeros(27)
    terms = Terms.of_sums(Objective(epsilon=1e-9), pose[None], np.array([0.146]), np.array([2.0]), np.array([5.0]))
    assert terms.depth[0] == pytest.approx(146 / 5)
    assert terms.silhouette[0] == pytest.approx(1 - 4 / 7)
    assert terms.energy[0] == pytest.approx(146 / 5 + 20 * (1 - 4 / 7))


def test_an_invisible_hand_has_no_agreement() -> None:
    terms = Terms.of_sums(Objective(), np.zeros((1, 27)), np.zeros(1), np.zeros(1), np.zeros(1))
    assert terms.energy[0] == pytest.approx(20)


@given(st.lists(st.floats(-0.5, 0.5), min_size=4, max_size=4))
def test_only_crossing_fingers_cost(abductions: list[float]) -> None:
    pose = np.zeros(27)
    for finger, angle in zip(("index", "middle", "ring", "little"), abductions, strict=True):
        pose[7 + ANGLE_NAMES.index(f"{finger}_mcp_abduction")] = angle
    pose[7 + ANGLE_NAMES.index("thumb_cmc_abduction")] = -3  # the thumb is left out
    expected = sum(max(b - a, 0) for a, b in pairwise(abductions))
    assert finger_crossing(pose) == pytest.approx(expected)


@pytest.mark.parametrize("change", [{"match_depth": 0}, {"clamp_depth": -1}, {"depth_unit": 0}, {"epsilon": 99}])
def test_constants_out_of_range_are_rejected(change: dict[str, float]) -> None:
    with pytest.raises(InputError, match=next(iter(change))):
        Objective(**change)
