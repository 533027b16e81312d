"""The wrist filter: anatomy, measurements, jumps and noise."""

import numpy as np
import pytest

from depthtrack.hand.shape import HandShape
from depthtrack.segmentation.forearm import Arm
from depthtrack.segmentation.grid import Paths
from depthtrack.segmentation.hand_size import HandSize
from depthtrack.segmentation.options import WristFilterOptions
from depthtrack.segmentation.palm import Palm
from depthtrack.segmentation.wrist_filter import WristFilter

OPTIONS = WristFilterOptions()
GATE = OPTIONS.gate * OPTIONS.measurement_sigma


def palm_at(x: float, radius: float = 0.04, tip_distance: float = 0.1) -> Palm:
    """Return a palm half a metre before the camera."""
    nothing = Paths(np.zeros((0, 0), np.float32), np.zeros((0, 0), np.int32))
    return Palm(0, np.array([x, 0.0, 0.5]), radius, tip_distance, nothing, ())


ARM = Arm(np.array([1.0, 0.0, 0.0]), np.zeros(0, np.int64))


def test_the_first_measurement_is_taken_over() -> None:
    assert WristFilter().update(palm_at(0), ARM, 0.07) == pytest.approx(0.07)
    assert WristFilter().update(palm_at(0), ARM, None) == pytest.approx(HandShape().palm_length / 2)
    # Only the length of a hand is known if it is seen edge-on.
    assert WristFilter().update(palm_at(0, radius=0.015), ARM, None) == pytest.approx(OPTIONS.hand_length - 0.1)


def test_the_wrist_stays_if_the_palm_jumps() -> None:
    wrist = WristFilter()
    for _ in range(5):
        wrist.update(palm_at(0.0), ARM, 0.06)
    # The widest place jumps to the fingers, and the wrist is not measured.
    assert wrist.update(palm_at(-0.05, radius=0.015), ARM, None) == pytest.approx(0.11, abs=0.005)
    assert wrist.guess(palm_at(-0.05)) == pytest.approx(0.11, abs=0.005)


def test_the_wrist_can_be_set() -> None:
    wrist = WristFilter()
    for _ in range(20):
        wrist.update(palm_at(0.0), ARM, 0.03)
    wrist.set_wrist(np.array([0.06, 0.0, 0.5]))
    assert wrist.guess(palm_at(0.0)) == pytest.approx(0.06)
    assert wrist.update(palm_at(0.0), ARM, 0.07) == pytest.approx(0.065, abs=1e-3)


def test_a_persistent_jump_is_followed_slowly() -> None:
    wrist = WristFilter()
    for _ in range(20):
        wrist.update(palm_at(0.0), ARM, 0.06)
    first = wrist.update(palm_at(0.0), ARM, 0.06 + 2 * GATE)
    assert 0.06 < first < 0.06 + 0.5 * GATE
    for _ in range(60):
        later = wrist.update(palm_at(0.0), ARM, 0.13)
    assert later == pytest.approx(0.13, abs=0.005)


def test_a_jump_is_rejected_if_the_hand_is_seen_edge_on() -> None:
    wrist = WristFilter()
    for _ in range(5):
        wrist.update(palm_at(0.0, radius=0.02), ARM, 0.06)
    far = 0.06 + 2 * GATE
    assert wrist.update(palm_at(0.0, radius=0.02), ARM, far) == pytest.approx(0.06, abs=1e-3)
    assert 0.061 < wrist.update(palm_at(0.0, radius=0.02), ARM, 0.07) < 0.07


def test_anatomy_depends_on_the_size_of_the_hand() -> None:
    child = WristFilter(hand=HandSize.of(HandShape(scale=0.7)))
    assert child.update(palm_at(0), ARM, None) == pytest.approx(0.7 * HandShape().palm_length / 2)


def test_noise_is_reduced() -> None:
    rng, wrist = np.random.default_rng(3), WristFilter()
    filtered = [wrist.update(palm_at(0.0), ARM, 0.06 + 0.008 * rng.normal()) for _ in range(200)]
    assert np.std(filtered[5:]) < 0.007
    assert np.mean(filtered) == pytest.approx(0.06, abs=0.002)
    assert OPTIONS.guess_sigma > OPTIONS.measurement_sigma
