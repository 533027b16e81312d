"""BVH files, read by pybvh: its forward kinematics gives our joints."""

from pathlib import Path

import numpy as np
import pybvh
import pytest

from depthtrack.errors import InputError
from depthtrack.export.bvh import BVH_JOINTS, euler_angles, evenly_timed
from depthtrack.export.registry import export_joints
from depthtrack.hand.kinematics import KEYPOINT_NAMES
from depthtrack.hand.shape import HandShape, Side
from tests.support.tracks import moving_poses, track_of


@pytest.mark.parametrize("side", ["right", "left"])
def test_joints_and_tips_of_another_reader_are_ours(tmp_path: Path, side: Side) -> None:
    track = track_of(moving_poses(9), HandShape(side=side, scale=1.1), start=1e9)
    export_joints(tmp_path / "a.bvh", track)
    motion = pybvh.read_bvh_file(tmp_path / "a.bvh", world_up="+y")
    assert (motion.frame_count, motion.frame_time) == (9, pytest.approx(1 / 30))
    names = [node.name for node in motion.nodes]
    assert [name for name in names if "EndSite" not in name] == list(BVH_JOINTS)
    placed = motion.node_positions() / 100 * [1, -1, -1]
    for number, name in enumerate(names):
        if "EndSite" in name:
            name = f"{names[number - 1].partition('_')[0]}_tip"
        np.testing.assert_allclose(placed[:, number], track.keypoints[:, KEYPOINT_NAMES.index(name)], atol=2e-6)


def test_a_flat_hand_at_rest_points_ahead_with_its_back_up(tmp_path: Path) -> None:
    """In the axes of OpenXR, where the thumb of a right hand with its palm down is on the left."""
    export_joints(tmp_path / "a.bvh", track_of(moving_poses(1)))
    motion = pybvh.read_bvh_file(tmp_path / "a.bvh", world_up="+y")
    rest = dict(zip([node.name for node in motion.nodes], motion.rest_pose_positions(), strict=True))
    assert rest["middle_dip"][2] < rest["middle_pip"][2] < rest["middle_mcp"][2] < -8
    assert abs(rest["middle_dip"][1]) < 0.1
    assert rest["index_mcp"][0] < 0 < rest["little_mcp"][0]
    assert rest["thumb_ip"][1] < -1


def test_rows_have_even_times_across_gaps(tmp_path: Path) -> None:
    poses = moving_poses(12)
    poses[[0, 4, 5, 11]] = np.nan
    export_joints(tmp_path / "a.bvh", track_of(poses))
    motion = pybvh.read_bvh_file(tmp_path / "a.bvh", world_up="+y")
    assert motion.frame_count == 10
    wrist = motion.node_positions()[:, 0] / 100
    between = wrist[2] + (wrist[5] - wrist[2]) * [[1 / 3], [2 / 3]]
    np.testing.assert_allclose(wrist[3:5], between, atol=5e-3)  # the wrist moves about the palm


def test_interpolated_poses_are_those_of_their_times() -> None:
    poses = moving_poses(40)
    times = np.arange(40) / 30
    jittered = times + np.random.default_rng(0).uniform(-0.004, 0.004, 40) * (np.arange(40) % 39 > 0)
    step, even = evenly_timed(times, poses)
    assert step == pytest.approx(1 / 30)
    np.testing.assert_allclose(even, poses, atol=1e-12)
    step, even = evenly_timed(jittered, poses)
    assert step == pytest.approx(1 / 30, rel=0.02)
    assert len(even) == pytest.approx(40, abs=1)


def test_angles_do_not_jump_by_full_turns() -> None:
    angle = np.linspace(0, 4 * np.pi, 100)
    turn = np.zeros((100, 1, 3, 3))
    turn[:, 0, 0, 0] = 1
    turn[:, 0, 1, 1] = turn[:, 0, 2, 2] = np.cos(angle)
    turn[:, 0, 2, 1], turn[:, 0, 1, 2] = np.sin(angle), -np.sin(angle)
    np.testing.assert_allclose(euler_angles(turn)[:, 0, 2], np.degrees(angle), atol=1e-6)


def test_impossible_motions_are_rejected(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no frame of the run has a pose"):
        export_joints(tmp_path / "a.bvh", track_of(np.full((2, 27), np.nan)))
    poses = moving_poses(4)
    with pytest.raises(InputError, match="fewer than 1,000,000 rows"):
        evenly_timed(np.array([0.0, 0.001, 0.002, 1e5]), poses)
    with pytest.raises(InputError, match=r"must increase, found 0\.1 s after 0\.2 s"):
        evenly_timed(np.array([0.0, 0.2, 0.1, 0.3]), poses)
    assert list(tmp_path.iterdir()) == []
