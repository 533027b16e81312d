"""Synthetic marker captures: truth, errors of measurement and reproducible bytes."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from depthtrack.errors import InputError
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.pose import ANGLES
from depthtrack.hand.shape import HandShape
from depthtrack.synthesis.marker_capture import MarkerSynthesis, SyntheticMarkers, synthesise_markers
from depthtrack.synthesis.marker_measurement import MeasurementErrors, shuffle_points
from depthtrack.types import Array

NO_ERRORS = MeasurementErrors(noise=0, dropouts=0, ghosts=0)


def made(**options: Any) -> SyntheticMarkers:
    return synthesise_markers(MarkerSynthesis(**{"frames": 200} | options))


def sorted_points(points: Array) -> Array:
    present = points[np.isfinite(points).all(axis=-1)]
    return present[np.lexsort(present.T)]


def test_without_errors_the_capture_holds_the_true_markers_in_another_order() -> None:
    synthetic = made(errors=NO_ERRORS)
    capture, true = synthetic.capture, synthetic.complete
    assert capture.positions.shape == true.positions.shape == (200, 26, 3)
    for frame in range(200):
        np.testing.assert_array_equal(sorted_points(capture.positions[frame]), sorted_points(true.positions[frame]))
    np.testing.assert_array_equal(synthetic.truth.labelled().positions, true.positions)
    assert not capture.is_labelled.any()
    assert not np.array_equal(synthetic.truth.columns[0][0], synthetic.truth.columns[0][1])


def test_the_truth_labels_noisy_samples() -> None:
    synthetic = made(frames=1000, errors=MeasurementErrors(noise=0.0005, dropouts=0.1, ghosts=3))
    residuals = synthetic.truth.residuals(0)
    missing = synthetic.truth.columns[0] < 0
    np.testing.assert_array_equal(np.isnan(residuals), missing)
    assert np.sqrt(np.nanmean(residuals**2) / 3) == pytest.approx(0.0005, rel=0.02)
    assert 0.1 <= missing[1:].mean() < 0.103
    assert not missing[0].any()


def test_ghosts_are_the_points_without_a_label() -> None:
    synthetic = made(errors=MeasurementErrors(ghosts=3))
    points = np.isfinite(synthetic.capture.positions).all(axis=-1).sum(axis=1)
    labelled = (synthetic.truth.columns[0] >= 0).sum(axis=1)
    assert points[0] == labelled[0] == 26
    assert set(points[1:] - labelled[1:]) == {3}


def test_dropouts_last_as_long_as_bursts_do() -> None:
    errors = MeasurementErrors(dropouts=0.2, bursts=(0.05, 0.1), complete_start=False)
    missing = made(frames=2000, errors=errors).truth.columns[0] < 0
    lengths = np.concatenate(
        [
            np.diff(np.flatnonzero(np.diff(np.r_[0, column, 0])))[::2]
            for column in missing.T[:, 200:-200].astype(np.int64)
        ]
    )
    # Bursts at the ends are cut, and a few that find no place of their own are joined to another one.
    assert np.median(lengths) == pytest.approx(15, abs=2)
    assert np.mean((lengths >= 10) & (lengths <= 20)) > 0.97
    assert missing.mean() == pytest.approx(0.2, abs=0.001)
    assert missing[0].any()


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_short_captures_have_dropouts_too(frames: int) -> None:
    missing = made(frames=frames, errors=MeasurementErrors(dropouts=0.9)).truth.columns[0] < 0
    assert not missing[0].any()
    assert missing[1:].all() or missing[1:].mean() >= 0.9


def test_the_subject_differs_from_the_model_and_stays_itself() -> None:
    one, other = made(seed=1), made(seed=2)
    assert one.models[0].hand == HandShape()
    assert one.truth.models[0].hand != other.truth.models[0].hand
    difference = one.truth.models[0].offsets - one.models[0].offsets
    assert 0.001 < np.abs(difference).mean() < 0.01
    assert made(seed=1, size_spread=0, placement=0).truth.models[0].to_json() == one.models[0].to_json()


def test_two_hands_touch_only_if_asked() -> None:
    def nearest(touching: bool) -> float:
        synthetic = made(motion="grasp", frames=800, two_hands=True, touching=touching, errors=NO_ERRORS)
        right, left = synthetic.positions
        return float(np.linalg.norm(right[:, :, None] - left[:, None], axis=-1).min())

    assert nearest(touching=True) < 0.03
    assert nearest(touching=False) > 0.08


def test_two_hands_are_a_right_and_a_left_one_of_one_subject() -> None:
    synthetic = made(two_hands=True, hand=HandShape(side="left"))
    right, left = (model.hand for model in synthetic.truth.models)
    assert right is not None
    assert left is not None
    assert (right.side, left.side) == ("right", "left")
    assert right == left.with_(side="right")
    assert synthetic.complete.labels[0] == "right:thumb_metacarpal"


def test_rigid_bodies_keep_their_shape_and_move() -> None:
    synthetic = made(rigid_bodies=2, rigid_markers=3, errors=NO_ERRORS)
    assert [model.name for model in synthetic.models] == ["right", "body1", "body2"]
    body = synthetic.positions[1]
    sides = np.linalg.norm(body - np.roll(body, 1, axis=1), axis=-1)
    np.testing.assert_allclose(sides, np.broadcast_to(sides[0], sides.shape), atol=1e-12)
    assert np.ptp(body, axis=0).max() > 0.005
    assert np.ptp(synthetic.truth.poses[1][:, ANGLES]) == 0


@given(
    motion=st.sampled_from(["everyday", "grasp", "random", "signs"]),
    side=st.sampled_from(["right", "left"]),
    two_hands=st.booleans(),
    seed=st.integers(0, 99),
)
@settings(max_examples=8, deadline=None)
def test_equal_options_give_equal_bytes_and_possible_poses(motion: str, side: Any, two_hands: bool, seed: int) -> None:
    options = MarkerSynthesis(
        motion, "13", HandShape(side=side), two_hands, two_hands, frames=60, rigid_bodies=1, start=1.0, seed=seed
    )
    one, again = synthesise_markers(options), synthesise_markers(options)
    assert one.capture.positions.tobytes() == again.capture.positions.tobytes()
    for poses in one.truth.poses:
        assert np.all(poses[:, ANGLES] >= LOWER - 1e-9)
        assert np.all(poses[:, ANGLES] <= UPPER + 1e-9)


def test_a_longer_capture_begins_with_the_shorter_one_without_dropouts() -> None:
    errors = MeasurementErrors(dropouts=0)
    short, long = made(frames=100, errors=errors), made(frames=200, errors=errors)
    for frame in range(100):
        np.testing.assert_array_equal(
            sorted_points(short.capture.positions[frame]), sorted_points(long.capture.positions[frame])
        )


@given(st.integers(1, 30), st.integers(1, 12), st.floats(0, 1), st.integers(0, 10))
@settings(max_examples=30, deadline=None)
def test_shuffled_points_are_found_at_their_columns(frames: int, markers: int, share: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(frames, markers, 3))
    points[rng.random((frames, markers)) < share] = np.nan
    shuffled, columns = shuffle_points(points, seed)
    for frame in range(frames):
        for marker in range(markers):
            if columns[frame, marker] < 0:
                assert np.isnan(points[frame, marker]).all()
            else:
                np.testing.assert_array_equal(shuffled[frame, columns[frame, marker]], points[frame, marker])
    assert np.isfinite(shuffled).sum() == np.isfinite(points).sum()


def test_a_random_motion_lasts_five_seconds_by_default() -> None:
    assert len(made(motion="random", frames=None, rate=20).capture) == 100


def test_the_start_in_the_motion_shifts_it() -> None:
    early, late = made(errors=NO_ERRORS), made(errors=NO_ERRORS, start=0.5, frames=100)
    np.testing.assert_allclose(late.truth.poses[0], early.truth.poses[0][100:], atol=1e-12)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"touching": True}, "only two hands can touch"),
        ({"rate": 0}, "between 1 and 2000 Hz"),
        ({"rigid_markers": 2}, "3 to 20 markers"),
        ({"size_spread": 3}, "between 0 and 2"),
        ({"placement": 1}, "0 and 20 mm"),
        ({"seed": -1}, "seed"),
        ({"frames": 100_000}, "can have 1 to 2400 frames"),
        ({"start": 13}, "can have 1 to 0 frames from 13 s"),
        ({"layout": "27"}, "unknown marker layout"),
    ],
)
def test_impossible_options_are_rejected(options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        made(**options)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"noise": -1}, "0 and 50 mm"),
        ({"dropouts": 0.95}, "0 and 90 %"),
        ({"ghosts": 1000}, "0 and 100"),
        ({"bursts": (0, 1)}, "bursts must last"),
        ({"bursts": (2, 1)}, "found 2 to 1 s"),
        ({"ghost_lives": (float("nan"), 1)}, "lives of ghosts"),
    ],
)
def test_impossible_errors_are_rejected(change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        replace(MeasurementErrors(), **change)
