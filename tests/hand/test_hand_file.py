"""Reading of hand files, rigs, and hand files that refer to a rig."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.hand.hand_file import load_hand
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import make_pose
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.mesh import Skin

FIST = make_pose([0.01, 0.02, 0.5], [0.3, -0.4, 0.5, 0.1], np.radians([10, 30, 40, 40] + [4, 80, 90, 50] * 4))


@pytest.fixture
def rig(own_glb: Path, tmp_path: Path) -> Path:
    return Path(shutil.copy(own_glb, tmp_path / "hand.glb"))


def test_a_rig_and_its_hand_file_are_the_same_hand(rig: Path) -> None:
    hand, file = load_hand(rig), rig.with_name("hand.json")
    file.write_text(hand.to_json())
    assert load_hand(file) == hand
    for name in ("lengths", "radii", "bases", "thumb_direction"):
        np.testing.assert_array_equal(getattr(load_hand(file), name), getattr(hand, name))
    assert Skin.of(load_hand(file)) is Skin.of(hand)


def test_a_relative_path_starts_at_the_hand_file(rig: Path) -> None:
    hand, file = load_hand(rig), rig.with_name("hand.json")
    fields = json.loads(hand.to_json())
    fields["rig"]["path"] = "hand.glb"
    file.write_text(json.dumps(fields))
    assert load_hand(file).rig == hand.rig


def test_the_joints_are_the_rigs_own(rig: Path) -> None:
    """A rig exported from the average hand has that hand's joints."""
    straight = make_pose(np.zeros(3), (1, 0, 0, 0), np.zeros(20))
    fingers = [HandModel(hand).keypoints(straight)[1:].reshape(5, 4, 3) for hand in (HandShape(), load_hand(rig))]
    ours, theirs = (np.linalg.norm(np.diff(joints, axis=1), axis=-1) for joints in fingers)
    np.testing.assert_allclose(ours, theirs, atol=3e-4)


def test_scale_and_side_change_the_mesh(rig: Path) -> None:
    hand = load_hand(rig)
    right, left = Skin.of(hand), Skin.of(hand.with_(side="left", scale=1.2))
    np.testing.assert_allclose(left.rest, 1.2 * right.rest * [-1, 1, 1], atol=1e-12)
    volumes = [skin.to_trimesh(skin.at(FIST)).volume for skin in (right, left)]
    assert volumes[1] == pytest.approx(1.2**3 * volumes[0], rel=0.02)
    model = HandModel(left.shape)
    tips = np.abs(left.to_trimesh(left.at(FIST)).nearest.on_surface(model.endpoints(FIST)[3::4])[1])
    assert tips.max() < 2e-3


def test_a_changed_or_missing_rig_is_rejected(rig: Path) -> None:
    hand = load_hand(rig)
    rig.write_bytes(rig.read_bytes().replace(b"depthtrack", b"othertrack"))
    with pytest.raises(InputError, match="must have the SHA-256"):
        Skin.of(hand.with_(scale=1.01))
    rig.unlink()
    with pytest.raises(InputError, match=r"hand\.glb is missing"):
        Skin.of(hand.with_(scale=1.02))


def test_other_sizes_than_the_rigs_are_rejected(rig: Path) -> None:
    hand = load_hand(rig)
    with pytest.raises(InputError, match="only scale and side may differ"):
        Skin.of(hand.with_(palm_length=0.1))
    assert Skin.of(hand.with_(palm_length=0.1, rig=None)).rest.shape[1] == 3


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"path": ""}, "path must be"),
        ({"path": "x" * 5000}, "path must be"),
        ({"path": 3}, "path must be"),
        ({"sha256": "abc"}, "64 hexadecimal digits"),
        ({"side": "middle"}, "'right' or 'left'"),
        ({"unit": 1e9}, "unit must be"),
        ({"unit": "m"}, "hand.json"),
    ],
)
def test_a_damaged_reference_gets_one_sentence(rig: Path, changes: dict[str, Any], message: str) -> None:
    fields = json.loads(load_hand(rig).to_json())
    fields["rig"] |= changes
    file = rig.with_name("hand.json")
    file.write_text(json.dumps(fields))
    with pytest.raises(InputError, match=message):
        load_hand(file)


def test_the_side_asked_for_must_be_the_files(tmp_path: Path) -> None:
    file = tmp_path / "hand.json"
    file.write_text(HandShape(side="left").to_json())
    assert load_hand(file, "left") == HandShape(side="left")
    with pytest.raises(InputError, match="holds a left hand"):
        load_hand(file, "right")
