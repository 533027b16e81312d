"""Smoothing fills gaps with what the visible markers and the capture show."""

import numpy as np
import pytest

from depthtrack.hand.pose import retract
from depthtrack.markers.filled_capture import Filling
from depthtrack.markers.filling.fill import fill_gaps
from depthtrack.markers.filling.motion_prior import learn_motion_prior
from depthtrack.markers.filling.options import FillOptions, SmoothFillOptions
from depthtrack.markers.filling.smoothing import Stretch, _equations, smooth
from depthtrack.markers.models.marker_model import MarkerModel
from tests.markers.filling.captures import RATE, cut, hand, labelled, poses


def stretch(frames: int, seed: int = 0) -> Stretch:
    generator = np.random.default_rng(seed)
    known = np.ones((len(poses()), 26), dtype=np.bool_)
    prior = learn_motion_prior(poses(), known, RATE, SmoothFillOptions())
    targets = hand().positions(poses()[:frames]) + generator.normal(0, 0.001, (frames, 13, 3))
    weights = (generator.random((frames, 13)) < 0.7) / 0.001**2
    offsets = np.tile(hand().offsets, (frames, 1, 1))
    return Stretch(hand().kinematics.chain, hand().bodies, offsets, targets, weights, prior, 26)


def test_the_gradient_is_that_of_the_energy() -> None:
    some, start = stretch(6), poses()[:6]
    energy, gradient, _ = _equations(some, start)
    generator = np.random.default_rng(3)
    for _ in range(5):
        direction = generator.normal(size=(6, 26)) * 1e-5
        ahead, behind = (_equations(some, retract(start, sign * direction))[0] for sign in (1, -1))
        # The second differences of rotations are linear in the step only near the identity.
        assert (ahead - behind) / 2 == pytest.approx(np.sum(gradient * direction), rel=2e-2)
    assert energy > 0


def test_smoothing_decreases_the_energy_to_a_minimum() -> None:
    some, generator = stretch(30), np.random.default_rng(4)
    start = retract(poses()[:30], generator.normal(0, 0.02, (30, 26)) * np.r_[np.full(3, 0.1), np.ones(23)])
    found = smooth(some, start, 20)
    least = _equations(some, found.poses)[0]
    assert least < _equations(some, start)[0]
    for _ in range(5):
        nearby = retract(found.poses, generator.normal(0, 1e-3, (30, 26)))
        assert _equations(some, nearby)[0] > least


def errors(label: str, start: int, stop: int, options: FillOptions) -> tuple[float, float]:
    """Return root mean square error and expected error of a gap, metres."""
    whole, m = hand().positions(poses()), hand().labels.index(label)
    noisy = whole + np.random.default_rng(5).normal(0, 0.0003, whole.shape)
    filled = fill_gaps(labelled(cut(noisy, (label, start, stop)), poses()), options)
    missed = np.linalg.norm(filled.positions[0][start:stop, m] - whole[start:stop, m], axis=-1)
    expected = filled.expected_error[0][start:stop, m]
    assert (filled.how[0][start:stop, m] == Filling.SMOOTHED).all()
    return float(np.sqrt(np.mean(missed**2))), float(np.sqrt(np.mean(expected**2)))


@pytest.mark.parametrize("regress", [True, False])
def test_a_fingertip_is_found_better_than_by_a_spline(regress: bool) -> None:
    missed, expected = errors("middle_tip", 150, 210, FillOptions(smooth=SmoothFillOptions(regress=regress)))
    whole, m = hand().positions(poses()), hand().labels.index("middle_tip")
    given = labelled(cut(whole, ("middle_tip", 150, 210)), poses())
    spline = fill_gaps(given, FillOptions(method="spline")).positions[0][150:210, m]
    assert missed < 0.4 * np.sqrt(np.mean(np.sum((spline - whole[150:210, m]) ** 2, axis=-1)))
    assert 0.2 < missed / expected < 4


def test_measured_samples_stay_as_they_are() -> None:
    given = cut(hand().positions(poses()), ("ring_tip", 50, 90), ("hand_top", 70, 100))
    filled = fill_gaps(labelled(given, poses()))
    seen = np.isfinite(given)
    assert (filled.positions[0][seen] == given[seen]).all()
    assert np.isfinite(filled.positions[0]).all()


def test_long_gaps_stay_gaps() -> None:
    given = labelled(cut(hand().positions(poses()), ("ring_tip", 50, 90), ("index_tip", 50, 160)), poses())
    filled = fill_gaps(given, FillOptions(longest=0.5))
    assert [filled.is_filled(gap) for gap in filled.gaps()] == [False, True]


def test_a_lost_hand_is_carried_across_the_loss() -> None:
    whole, lost = hand().positions(poses()), poses().copy()
    lost[100:110] = np.nan
    given = whole.copy()
    given[100:110] = np.nan
    filled = fill_gaps(labelled(given, lost))
    assert np.linalg.norm(filled.positions[0] - whole, axis=-1).max() < 0.01
    assert np.isfinite(filled.poses[0]).all()


def test_a_rigid_body_is_exact_with_three_markers_left() -> None:
    generator = np.random.default_rng(0)
    model = MarkerModel(
        "box", ("a", "b", "c", "d"), np.zeros(4, np.int64), generator.normal(0, 0.05, (4, 3)), np.zeros(4)
    )
    moving = poses().copy()
    moving[:, 7:] = 0
    whole = model.positions(moving)
    filled = fill_gaps(labelled(cut(whole, ("b", 100, 200), model=model), moving, model))
    assert np.abs(filled.positions[0] - whole).max() < 1e-4


def test_pieces_join_to_the_whole() -> None:
    gaps = [(label, t, t + 40) for t, label in enumerate(hand().labels[3:], 1) for t in range(10 + 23 * t, 340, 60)]
    given = labelled(cut(hand().positions(poses()), *gaps), poses())
    whole, pieces = (
        fill_gaps(given, FillOptions(smooth=SmoothFillOptions(piece=piece, regress=False))) for piece in (20.0, 1.0)
    )
    assert np.isfinite(pieces.positions[0]).all()
    apart = np.linalg.norm(whole.positions[0] - pieces.positions[0], axis=-1)
    assert 0 < apart.max() < 0.002
    assert np.median(apart[apart > 0]) < 1e-4


def test_a_hand_that_is_lost_everywhere_stays_lost() -> None:
    given = labelled(cut(hand().positions(poses()), ("ring_tip", 50, 90)), np.full_like(poses(), np.nan))
    filled = fill_gaps(given, FillOptions(smooth=SmoothFillOptions(regress=False)))
    assert (filled.how[0][50:90, hand().labels.index("ring_tip")] == Filling.GAP).all()


def test_the_same_capture_gives_the_same_bits() -> None:
    given = labelled(cut(hand().positions(poses()), ("ring_tip", 50, 90)), poses())
    first, second = fill_gaps(given), fill_gaps(given)
    assert np.array_equal(first.positions[0], second.positions[0])
    assert np.array_equal(first.expected_error[0], second.expected_error[0], equal_nan=True)


def test_a_gap_of_the_longest_length_is_filled() -> None:
    given = labelled(cut(hand().positions(poses()), ("ring_tip", 50, 107)), poses())
    assert np.isfinite(fill_gaps(given, FillOptions(method="pattern", longest=57 / RATE)).positions[0]).all()
