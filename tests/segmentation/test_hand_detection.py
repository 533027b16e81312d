"""Detection of the hand: nearest first, near its last position, and costs."""

from dataclasses import replace

import numpy as np
import pytest

from depthtrack.segmentation.hand_detection import HandDetector
from depthtrack.segmentation.hand_size import AVERAGE_HAND
from depthtrack.segmentation.options import SegmentationOptions
from tests.support.arms import club

OPTIONS = SegmentationOptions()
DETECTOR = HandDetector(OPTIONS, AVERAGE_HAND)


def test_the_hand_is_detected_at_its_palm() -> None:
    grid, palm = club(0.0)
    found = DETECTOR.detect(grid, grid)
    np.testing.assert_allclose(found[0].centre, palm.centre, atol=0.02)
    assert [hand.cost for hand in found] == sorted(hand.cost for hand in found)


def test_no_hand_is_detected_without_candidates() -> None:
    grid, _ = club(0.0)
    nothing = grid.within(np.zeros(grid.depth.shape, np.bool_))
    assert DETECTOR.detect(grid, nothing) == []
    assert DETECTOR.nearest_palm(grid, nothing, np.array([0.0, 0.0, 0.5])) is None


def test_a_palm_is_followed_up_to_the_largest_step() -> None:
    grid, palm = club(0.0)
    step = OPTIONS.detection.largest_step
    for distance, found in ((0.5 * step, True), (3.5 * step, False)):
        last = palm.centre + np.array([0.0, 0.0, -distance])
        assert (DETECTOR.nearest_palm(grid, grid, last) is not None) == found


def test_a_palm_at_a_known_place_may_be_smaller() -> None:
    """The grid that follows samples other pixels than the detection."""
    grid, palm = club(0.0)
    narrow = replace(OPTIONS.palm, least_radius=1.1 * palm.radius)
    assert HandDetector(replace(OPTIONS, palm=narrow), AVERAGE_HAND).detect(grid, grid) == []
    for share, found in ((0.8, True), (1.0, False)):
        detector = HandDetector(replace(OPTIONS, palm=replace(narrow, known_share=share)), AVERAGE_HAND)
        assert (detector.nearest_palm(grid, grid, palm.centre) is not None) == found


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_options_at_a_known_place_stay_in_their_ranges(share: float) -> None:
    for options in (OPTIONS.palm, replace(OPTIONS.palm, least_area=1e-4)):
        near = replace(options, known_share=share).at_known_place
        assert near.least_area == max(share * options.least_area, 1e-4)
        assert near.least_radius == share * options.least_radius


def test_costs_are_the_sum_of_their_terms() -> None:
    """A weight of zero removes its term; the last position adds its distance."""
    grid, palm = club(0.0)
    cost = DETECTOR.start_cost(grid, grid, palm, None)
    lost = palm.centre + np.array([0.0, 0.03, 0.04])
    assert DETECTOR.start_cost(grid, grid, palm, lost) == pytest.approx(cost + 0.05)
    without = HandDetector(replace(OPTIONS, detection=replace(OPTIONS.detection, distance_weight=0.0)), AVERAGE_HAND)
    change = OPTIONS.detection.distance_weight * palm.centre[2]
    assert without.start_cost(grid, grid, palm, None) == pytest.approx(cost - change)
