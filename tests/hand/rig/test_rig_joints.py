"""Finger joints by name, in the naming schemes of common programs."""

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.hand.pose import FINGERS
from depthtrack.hand.rig.rig_joints import finger_joints, finger_of, side_of

NAMINGS = {
    "rigify": "thumb.01.R f_index.02.R DEF-f_pinky.03.R",
    "makehuman": "finger1-1.R finger2-2.R finger5-3.R",
    "unreal": "thumb_01_r index_02_r pinky_03_r",
    "mixamo": "mixamorig:RightHandThumb1 mixamorig:RightHandIndex2 mixamorig:RightHandPinky3",
    "unity": "RightThumbProximal RightIndexIntermediate RightLittleDistal",
    "unity-xr": "R_ThumbMetacarpal R_IndexIntermediate R_LittleDistal",
    "mediapipe": "RIGHT_THUMB_CMC RIGHT_INDEX_FINGER_PIP RIGHT_PINKY_DIP",
    "oculus": "b_r_thumb1 b_r_index2 b_r_pinky3",
    "mano": "rthumb0 rindex1 rpinky2",
    "plain": "right_thumb1 right_index2 right_pinky3",
}


@pytest.mark.parametrize("scheme", NAMINGS)
def test_names_of_common_rigs(scheme: str) -> None:
    names = NAMINGS[scheme].split()
    assert [finger_of(name) for name in names] == [0, 1, 4]
    assert [side_of(name) for name in names] == ["right"] * 3


@pytest.mark.parametrize("name", ["LeftToeIndex", "spine_02", "palm.01.R", "hand_r", "wrist", "finger12-1", "Armature"])
def test_other_bones_are_no_fingers(name: str) -> None:
    assert finger_of(name) is None


def test_metacarpals_tips_and_flat_hierarchies() -> None:
    """Names order WebXR's 25 joints without a tree; metacarpals and tips are left out."""
    words = ("tip", "phalanx-distal", "phalanx-intermediate", "phalanx-proximal", "metacarpal")
    fingers = ("thumb", "index-finger", "middle-finger", "ring-finger", "pinky-finger")
    names = [f"{f}-{w}" for f in fingers for w in words if (f, w) != ("thumb", "phalanx-intermediate")] + ["wrist"]
    found = finger_joints(names, np.full(len(names), -1), np.ones(len(names)), None)
    assert [names[j] for j in found[0]] == ["thumb-metacarpal", "thumb-phalanx-proximal", "thumb-phalanx-distal"]
    assert [names[j] for j in found[2]] == [f"middle-finger-{w}" for w in words[3:0:-1]]


def test_anatomical_names_order_a_flat_rig() -> None:
    """MediaPipe's landmarks are joints in any order."""
    fingers = {
        "THUMB": ("CMC", "MCP", "IP"),
        **dict.fromkeys(("INDEX_FINGER", "MIDDLE_FINGER", "RING_FINGER", "PINKY"), ("MCP", "PIP", "DIP")),
    }
    names = sorted(["WRIST", *(f"{f}_{j}" for f, joints in fingers.items() for j in (*joints, "TIP"))])
    found = finger_joints(names, np.full(len(names), -1), np.ones(len(names)), None)
    assert [[names[j] for j in row] for row in found] == [[f"{f}_{j}" for j in js] for f, js in fingers.items()]


def test_fourth_joints_without_weights_are_tips_and_sides_do_not_mix() -> None:
    names = [f"{side}Hand{f.title()}{k}" for side in ("Left", "Right") for f in FINGERS for k in (1, 2, 3, 4)]
    parents = np.array([n - 1 if n % 4 else -1 for n in range(len(names))])
    loads = np.array([0.0 if n % 4 == 3 else 1.0 for n in range(len(names))])
    found = finger_joints(names, parents, loads, "right")
    assert [names[j] for j in found[3]] == ["RightHandRing1", "RightHandRing2", "RightHandRing3"]
    with pytest.raises(InputError, match="both hands"):
        finger_joints(names, parents, loads, None)
