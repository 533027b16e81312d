"""The one-euro filter: exact at rest, with the stated delay in motion, new after a gap."""

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.hand.one_euro import OneEuroFilter, OneEuroOptions, smooth
from depthtrack.hand.pose import make_pose, retract, tangent_between
from depthtrack.types import Array
from tests.support.tracks import moving_poses

RATE = 60.0
REST = make_pose([0.0, 0.0, 0.5], [0.6, 0.0, 0.8, 0.0], np.full(20, 0.3))


def times(frames: int) -> Array:
    return 5.0 + np.arange(frames) / RATE


def test_a_hand_at_rest_stays() -> None:
    smoothed, delays = smooth(np.tile(REST, (10, 1)), times(10))
    np.testing.assert_allclose(smoothed, np.tile(REST, (10, 1)), atol=1e-12)
    np.testing.assert_allclose(delays[1:], 1 / (2 * np.pi * OneEuroOptions().min_cutoff))


@pytest.mark.parametrize("value", [0, 4, 12])
def test_steady_motion_lags_by_the_stated_delay(value: int) -> None:
    """Position, orientation and a finger angle of a constant speed, 300 frames after its start."""
    velocity = np.zeros(26)
    velocity[value] = 0.5
    poses = np.stack([retract(REST, velocity * k / RATE) for k in range(300)])
    smoothed, delays = smooth(poses, times(300))
    lag = tangent_between(smoothed[-1], poses[-1]) / 0.5
    kind = 0 if value < 3 else 1 if value < 6 else 2
    options = OneEuroOptions()
    beta = (options.position_beta, options.rotation_beta, options.angle_beta)[kind]
    expected = 1 / (2 * np.pi * (options.min_cutoff + beta * 0.5))
    assert lag[value] == pytest.approx(expected, rel=0.01)
    at_rest = 1 / (2 * np.pi * options.min_cutoff)
    mean = expected if kind < 2 else (expected + 19 * at_rest) / 20
    assert delays[-1, kind] == pytest.approx(mean, rel=0.01)


def test_noise_shrinks_and_fast_motion_is_followed() -> None:
    random = np.random.default_rng(0)
    noise = random.normal(size=(400, 26)) * 0.003
    poses = retract(np.tile(REST, (400, 1)), noise)
    smoothed, _ = smooth(poses, times(400))
    assert tangent_between(np.tile(REST, (400, 1)), smoothed)[50:].std() < 0.6 * 0.003
    fast = moving_poses(60)
    strong = OneEuroOptions(min_cutoff=0.5)
    stiff = OneEuroOptions(min_cutoff=0.5, position_beta=0, rotation_beta=0, angle_beta=0)
    followed, late = (np.abs(smooth(fast, times(60), options)[0] - fast).mean() for options in (strong, stiff))
    assert followed < 0.6 * late


def test_the_filter_starts_again_after_a_gap_and_keeps_rows_without_a_pose() -> None:
    poses = moving_poses(60)
    poses[20:45] = np.nan
    smoothed, delays = smooth(poses, times(60))
    assert np.isnan(smoothed[20:45]).all()
    np.testing.assert_array_equal(smoothed[[0, 45]], poses[[0, 45]])
    np.testing.assert_array_equal(delays[45], 0)
    alone, _ = smooth(poses[45:], times(60)[45:])
    np.testing.assert_array_equal(smoothed[45:], alone)
    poses[50] = np.nan  # a short gap
    assert not np.array_equal(smooth(poses, times(60))[0][51], poses[51])


def test_poses_as_they_arrive_are_filtered_as_at_once() -> None:
    poses, live = moving_poses(20), OneEuroFilter()
    smoothed, _ = smooth(poses, times(20))
    assert live.update(None, 4.9) is None
    for pose, time, expected in zip(poses, times(20), smoothed, strict=True):
        filtered = live.update(pose, float(time))
        assert filtered is not None
        np.testing.assert_array_equal(filtered, expected)
        filtered[:] = 0  # a copy
    np.testing.assert_allclose(np.linalg.norm(smoothed[:, 3:7], axis=1), 1)


def test_unusable_options_are_rejected() -> None:
    with pytest.raises(InputError, match="must be finite and above 0 Hz, found -1"):
        OneEuroOptions(min_cutoff=-1)
    with pytest.raises(InputError, match="above 0 Hz"):
        OneEuroOptions(speed_cutoff=float("nan"))
    with pytest.raises(InputError, match="at least 0"):
        OneEuroOptions(angle_beta=-0.1)
