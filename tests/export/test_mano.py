"""MANO parameters: forward kinematics of the model's own equations gives our joints.

No library with a permissive licence reads them, so numpy, json and scipy do.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from depthtrack.export.mano import MANO_JOINTS, MANO_PARENTS, TEMPLATE
from depthtrack.export.registry import export_joints
from depthtrack.hand.shape import HandShape, Side
from depthtrack.types import Array
from tests.support.tracks import moving_poses, track_of

OUR_KEYPOINTS = (0, 5, 6, 7, 9, 10, 11, 17, 18, 19, 13, 14, 15, 1, 2, 3)
"""Number of MANO's joints among the 21 keypoints."""


@pytest.fixture(params=["right", "left"])
def side(request: pytest.FixtureRequest) -> Side:
    chosen: Side = request.param
    return chosen


def mano_joints(file: Any) -> Array:
    """Return the joints (T, 16, 3) by Eq. 2 to 4 of Loper et al., "SMPL", 2015."""
    pose = np.concatenate([file["global_orient"], file["hand_pose"]], axis=1).reshape(-1, 16, 3)
    rest = np.asarray(file["rest_joints"])
    chains: list[Array] = []
    for joint, parent in enumerate(file["parents"]):
        local = np.tile(np.eye(4), (len(pose), 1, 1))
        local[:, :3, :3] = Rotation.from_rotvec(pose[:, joint]).as_matrix()
        local[:, :3, 3] = rest[joint] - (rest[parent] if parent >= 0 else 0)
        chains.append(local if parent < 0 else chains[parent] @ local)
    return np.stack([chain[:, :3, 3] for chain in chains], axis=1) + np.asarray(file["transl"])[:, None]


def test_the_order_is_that_of_the_model() -> None:
    assert MANO_JOINTS[:4] == ("wrist", "index1", "index2", "index3")
    assert [MANO_JOINTS[row] for row in (4, 7, 10, 13)] == ["middle1", "pinky1", "ring1", "thumb1"]
    assert MANO_PARENTS == (-1, 0, 1, 2, 0, 4, 5, 0, 7, 8, 0, 10, 11, 0, 13, 14)


def test_forward_kinematics_gives_our_joints(tmp_path: Path, side: Side) -> None:
    poses = moving_poses(5)
    poses[1] = np.nan
    track = track_of(poses, HandShape(side=side, scale=0.9))
    export_joints(tmp_path / "a.npz", track, "mano")
    with np.load(tmp_path / "a.npz", allow_pickle=False) as file:
        assert (str(file["side"]), bool(file["flat_hand_mean"])) == (side, True)
        joints = mano_joints(file)
        assert file["hand_pose"].shape == (5, 45)
    assert np.isnan(joints[1]).all()
    np.testing.assert_allclose(joints, track.keypoints[:, OUR_KEYPOINTS], atol=1e-9)


def test_json_holds_the_same_numbers(tmp_path: Path, side: Side) -> None:
    poses = moving_poses(4)
    poses[0] = np.nan
    track = track_of(poses, HandShape(side=side))
    export_joints(tmp_path / "a.json", track, "mano")
    export_joints(tmp_path / "a.npz", track, "mano")
    content = json.loads((tmp_path / "a.json").read_text())
    assert content["hand_pose"][0] is content["transl"][0] is None
    with np.load(tmp_path / "a.npz", allow_pickle=False) as file:
        np.testing.assert_array_equal(content["hand_pose"][1:], file["hand_pose"][1:])
        np.testing.assert_array_equal(content["rest_joints"], file["rest_joints"])
        assert content["joint_names"] == file["joint_names"].tolist()


def test_axes_at_rest_are_those_of_the_model(tmp_path: Path, side: Side) -> None:
    """Fingers along -x of a right hand and +x of a left one, thumb to +z, flexion to -y."""
    poses = moving_poses(2)
    poses[:, 7:] = TEMPLATE
    poses[1, 7 + 8 + 2] += 0.5  # flexion of the middle finger's second joint
    export_joints(tmp_path / "a.npz", track_of(poses, HandShape(side=side)), "mano")
    forward = -1.0 if side == "right" else 1.0
    with np.load(tmp_path / "a.npz", allow_pickle=False) as file:
        rest = dict(zip(file["joint_names"].tolist(), file["rest_joints"], strict=True))
        flexion = file["hand_pose"][1, 12:15]
        np.testing.assert_allclose(file["hand_pose"][0], 0, atol=1e-12)
    assert forward * rest["middle1"][0] > 0.08
    assert rest["index1"][2] > 0.02 > -0.02 > rest["pinky1"][2]
    assert rest["thumb1"][2] > 0.01
    assert np.linalg.norm(flexion) == pytest.approx(0.5)
    np.testing.assert_allclose(flexion, [0, 0, -forward * 0.5], atol=0.1)  # the finger is abducted by 10 degrees
