"""OpenXR's joints: rotations with the stated axes, at our joints, mirrored for left hands."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import KDTree

from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.openxr_joints import (
    OPENXR_JOINTS,
    OPENXR_PARENTS,
    joint_frames,
    openxr_radii,
    openxr_transforms,
)
from depthtrack.hand.pose import FINGERS, make_pose
from depthtrack.hand.shape import HandShape, Side
from depthtrack.hand.skin.mesh import Skin
from depthtrack.types import Array

FLAT = make_pose([0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], np.zeros(20))
seeds = st.integers(0, 2**32 - 1)
sides = st.sampled_from(("right", "left"))


def joint(name: str) -> int:
    return OPENXR_JOINTS.index(name)


def random_pose(seed: int) -> Array:
    random = np.random.default_rng(seed)
    return make_pose(random.uniform(-0.5, 0.5, 3), random.normal(size=4), random.uniform(LOWER, UPPER))


def test_the_joints_are_those_of_the_standard() -> None:
    assert len(OPENXR_JOINTS) == len(OPENXR_PARENTS) == 26
    numbers = {"palm": 0, "wrist": 1, "thumb_metacarpal": 2, "thumb_tip": 5, "index_metacarpal": 6, "index_tip": 10}
    assert {name: joint(name) for name in numbers} == numbers
    assert joint("little_tip") == 25
    assert OPENXR_PARENTS[:4] == (joint("wrist"), -1, joint("wrist"), joint("thumb_metacarpal"))
    assert all(OPENXR_PARENTS[joint(f"{finger}_metacarpal")] == joint("wrist") for finger in FINGERS)


@given(seeds, sides)
def test_frames_are_rotations_at_our_joints(seed: int, side: Side) -> None:
    model, pose = HandModel(HandShape(side=side, scale=1.1)), random_pose(seed)
    T = openxr_transforms(model, pose)
    np.testing.assert_allclose(T[:, :3, :3].swapaxes(1, 2) @ T[:, :3, :3], np.tile(np.eye(3), (26, 1, 1)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(T[:, :3, :3]), 1)
    keypoints = model.keypoints(pose)
    ours = [1, *range(2, 6), *(6 + 5 * finger + bone for finger in range(4) for bone in range(1, 5))]
    np.testing.assert_allclose(T[ours, :3, 3], keypoints, atol=1e-12)


@given(seeds, sides)
def test_minus_z_points_along_the_bone_to_the_next_joint(seed: int, side: Side) -> None:
    T = openxr_transforms(HandModel(HandShape(side=side)), random_pose(seed))
    for number, parent in enumerate(OPENXR_PARENTS):
        if parent > 1:
            bone = T[number, :3, 3] - T[parent, :3, 3]
            np.testing.assert_allclose(-T[parent, :3, 2], bone / np.linalg.norm(bone), atol=1e-9)
    middle = T[joint("middle_metacarpal"), :3, 3]
    wrist = middle - T[joint("wrist"), :3, 3]
    np.testing.assert_allclose(-T[joint("wrist"), :3, 2], wrist / np.linalg.norm(wrist), atol=1e-9)
    # The palm is the centre of the middle finger's metacarpal bone, and turned as that bone.
    np.testing.assert_allclose(T[0, :3, 3], (middle + T[joint("middle_proximal"), :3, 3]) / 2, atol=1e-12)
    np.testing.assert_allclose(T[0, :3, :3], T[joint("middle_metacarpal"), :3, :3], atol=1e-12)


@pytest.mark.parametrize("side", ["right", "left"])
def test_y_points_out_of_the_back_of_the_flat_hand(side: Side) -> None:
    """Seen with the palm to the viewer, z of the palm frame points out of the palm."""
    T = openxr_transforms(HandModel(HandShape(side=side)), FLAT)
    fingers = [number for number, name in enumerate(OPENXR_JOINTS) if not name.startswith("thumb")]
    assert np.all(T[fingers, 2, 1] < -0.99)
    # +X is to the right with the palm down and the fingers ahead, so the thumb of a right hand lies at -X.
    thumb = T[joint("thumb_tip"), :3, 3] - T[joint("wrist"), :3, 3]
    towards = float(thumb @ T[joint("wrist"), :3, 0])
    assert (towards < -0.03) if side == "right" else (towards > 0.03)


def test_y_points_out_of_the_nail_of_a_bent_finger() -> None:
    """A finger bends towards its pad, so the tip moves to -Y of the bone before."""
    pose = FLAT.copy()
    pose[[7 + 4 * finger + 2 for finger in range(5)]] = 0.5
    T = openxr_transforms(HandModel(HandShape()), pose)
    for finger in FINGERS:
        tip, before = joint(f"{finger}_tip"), joint(f"{finger}_proximal") - (finger == "thumb")
        assert (T[tip, :3, 3] - T[before, :3, 3]) @ T[before, :3, 1] < -0.01


@given(seeds)
def test_left_hands_are_mirror_images(seed: int) -> None:
    """A left hand is the mirror image in x of the palm, with right-handed frames."""
    random = np.random.default_rng(seed)
    pose = make_pose([0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], random.uniform(LOWER, UPPER))
    right, left = (openxr_transforms(HandModel(HandShape(side=side)), pose) for side in ("right", "left"))
    mirror = np.diag([-1.0, 1.0, 1.0, 1.0])
    np.testing.assert_allclose(left, mirror @ right @ mirror, atol=1e-12)
    assert openxr_radii(HandShape(side="left")).tolist() == openxr_radii(HandShape()).tolist()


def test_metacarpals_have_about_published_lengths() -> None:
    """Buryanov and Kotiuk 2010, millimetres."""
    T = openxr_transforms(HandModel(HandShape()), FLAT)
    for finger, length in {"index": 68.1, "middle": 64.6, "ring": 58.0, "little": 53.7}.items():
        bone = T[joint(f"{finger}_proximal"), :3, 3] - T[joint(f"{finger}_metacarpal"), :3, 3]
        assert 1000 * np.linalg.norm(bone) == pytest.approx(length, abs=5)


def test_radii_are_the_distances_to_the_skin() -> None:
    """Tips are on the skin. The wrist is left out, since the built skin ends there."""
    shape = HandShape(scale=1.2)
    skin = Skin.of(shape)
    T = openxr_transforms(HandModel(shape), FLAT)
    distance = np.asarray(KDTree(skin.at(FLAT)).query(T[:, :3, 3])[0])
    tips = np.array([name.endswith("_tip") for name in OPENXR_JOINTS])
    assert np.all(distance[tips] < 0.003)
    radii = openxr_radii(shape)
    assert np.all(radii > 0)
    inside = ~tips & (np.arange(26) != joint("wrist"))
    np.testing.assert_allclose(radii[inside], distance[inside], atol=0.003)


def test_frames_are_fixed_to_bodies() -> None:
    bodies, T_body_joint = joint_frames(HandShape())
    assert bodies.tolist() == [0, 0, 1, 2, 3, 3, *(b for f in (3, 6, 9, 12) for b in (0, f + 1, f + 2, f + 3, f + 3))]
    assert T_body_joint.shape == (26, 4, 4)
