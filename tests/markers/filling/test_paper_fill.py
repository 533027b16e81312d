"""The paper's gap handling: frozen joints, plausible reappearance, interpolated angles."""

import numpy as np
import pytest

from depthtrack.hand.pose import ANGLE_NAMES, ANGLES
from depthtrack.markers.filled_capture import Filling
from depthtrack.markers.filling.fill import fill_gaps
from depthtrack.markers.filling.interpolation import minimal_acceleration
from depthtrack.markers.filling.joints import determined
from depthtrack.markers.filling.options import FillMethod, FillOptions
from tests.markers.filling.captures import cut, hand, labelled, poses

PAPER = FillOptions(method="paper")


def undetermined(*missing: str) -> set[str]:
    visible = np.array([label not in missing for label in hand().labels])
    found = determined(hand(), visible)
    return {name for name, known in zip(ANGLE_NAMES, found[6:], strict=True) if not known}


def test_a_fingertip_determines_the_joints_beyond_the_next_marker() -> None:
    assert undetermined("index_tip") == {"index_pip_flexion", "index_dip_flexion"}


def test_a_visible_fingertip_drives_the_whole_chain() -> None:
    assert undetermined("index_middle") == set()


def test_a_finger_without_markers_is_frozen() -> None:
    assert undetermined("ring_tip", "ring_middle") == {name for name in ANGLE_NAMES if name.startswith("ring")}


def test_three_markers_determine_the_palm() -> None:
    visible = np.zeros(13, dtype=np.bool_)
    visible[:3] = True
    assert determined(hand(), visible)[:6].all()
    visible[0] = False
    assert not determined(hand(), visible)[:6].any()


def test_angles_are_interpolated_and_the_others_kept() -> None:
    whole, true = hand().positions(poses()), poses()
    frozen = true.copy()
    frozen[100:150, [13, 14]] = true[99, [13, 14]]
    filled = fill_gaps(labelled(cut(whole, ("index_tip", 100, 150)), frozen), PAPER)
    expected = frozen.copy()
    expected[100:150, [13, 14]] = minimal_acceleration(true[98:100, [13, 14]], true[150:152, [13, 14]], 50)
    np.testing.assert_allclose(filled.poses[0][:, ANGLES], expected[:, ANGLES], atol=1e-9)
    m = hand().labels.index("index_tip")
    np.testing.assert_allclose(filled.positions[0][100:150, m], hand().positions(expected[100:150])[:, m], atol=1e-9)
    assert (filled.how[0][100:150, m] == Filling.INTERPOLATED).all()
    assert np.isfinite(filled.expected_error[0][100:150, m]).all()


def test_a_marker_inside_the_chain_follows_the_kinematics() -> None:
    whole = hand().positions(poses())
    filled = fill_gaps(labelled(cut(whole, ("index_middle", 100, 150)), poses()), PAPER)
    m = hand().labels.index("index_middle")
    assert (filled.how[0][100:150, m] == Filling.KINEMATIC).all()
    np.testing.assert_allclose(filled.positions[0], whole, atol=1e-9)


def test_several_gaps_are_filled_at_once() -> None:
    whole = hand().positions(poses())
    gaps = (("index_tip", 100, 150), ("ring_tip", 120, 170), ("ring_middle", 130, 180))
    filled = fill_gaps(labelled(cut(whole, *gaps), poses()), PAPER)
    assert np.isfinite(filled.positions[0]).all()
    assert [(gap.start, gap.stop) for gap in filled.gaps()] == [(100, 150), (120, 170), (130, 180)]


def test_an_implausible_reappearance_is_replaced() -> None:
    whole, m = hand().positions(poses()), hand().labels.index("index_tip")
    given = cut(whole, ("index_tip", 100, 150))
    given[150:154, m] += 0.03
    filled = fill_gaps(labelled(given, poses()), PAPER)
    assert (filled.how[0][150:154, m] == Filling.REPLACED).all()
    assert filled.how[0][154, m] == Filling.MEASURED
    assert np.linalg.norm(filled.positions[0][150:154, m] - whole[150:154, m], axis=-1).max() < 0.015


@pytest.mark.parametrize("gap", [(0, 30), (380, 400)])
def test_gaps_at_the_ends_stay_unless_asked_for(gap: tuple[int, int]) -> None:
    whole, m = hand().positions(poses()), hand().labels.index("index_tip")
    given = labelled(cut(whole, ("index_tip", *gap)), poses())
    methods: tuple[FillMethod, ...] = ("paper", "smooth")
    for method in methods:
        left = fill_gaps(given, FillOptions(method=method))
        assert (left.how[0][slice(*gap), m] == Filling.GAP).all()
        assert np.isnan(left.positions[0][slice(*gap), m]).all()
        done = fill_gaps(given, FillOptions(method=method, ends=True))
        assert np.isfinite(done.positions[0]).all()
