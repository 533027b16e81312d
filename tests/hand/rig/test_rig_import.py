"""Rigged hands from glTF files: exported skins read back equal, and rigs of other programs."""

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from depthtrack.errors import InputError
from depthtrack.geometry.rotations import quaternion_from_matrix
from depthtrack.hand.hand_file import load_hand
from depthtrack.hand.kinematics import JOINT_NAMES, HandModel, body_of
from depthtrack.hand.pose import make_pose
from depthtrack.hand.rig.gltf import read_rigs
from depthtrack.hand.rig.gltf_writer import export_glb
from depthtrack.hand.rig.rig_import import mapping_path, read_rigged_hand
from depthtrack.hand.shape import HandShape, Side
from depthtrack.hand.skin.mesh import Skin
from tests.support.rigs import distances, load_skin, parts, write_gltf, write_makehuman_rig, write_rig

pytest.importorskip("pygltflib", reason="rigged hands need the extra: pip install 'depthtrack[gltf]'")

DEFAULT = HandShape()
FIST = np.radians([(12, 22, 45, 45), (4, 80, 100, 60), (0, 85, 100, 60), (-4, 85, 100, 60), (-8, 85, 100, 60)])


@pytest.mark.parametrize("side", ["right", "left"])
def test_an_exported_skin_reads_back_equal_in_every_pose(tmp_path: Path, side: Side) -> None:
    """Both meshes coincide in a fist at a random position and orientation."""
    shape = DEFAULT.with_(side=side, scale=1.1)
    skin, path = Skin.of(shape), tmp_path / "hand.glb"
    export_glb(skin, path)
    again = load_skin(path)
    assert again.shape.side == side

    np.testing.assert_allclose(again.shape.lengths, shape.lengths * 1.1, rtol=0, atol=0.2e-3)
    np.testing.assert_allclose(again.shape.radii, shape.radii * 1.1, rtol=0.12)
    for name in ("palm_breadth", "palm_length", "palm_thickness", "wrist_breadth", "wrist_thickness"):
        assert getattr(again.shape, name) == pytest.approx(getattr(shape, name) * 1.1, rel=0.2)

    # The rig's palm frame has y towards the middle knuckle, so it is rotated, and abductions count from there.
    knuckle = shape.bases[2] - HandShape().wrist
    turn = np.arctan2(knuckle[0], knuckle[1])
    c, s = np.cos(turn), np.sin(turn) * shape.mirror
    T = np.eye(4)
    T[:3, :3] = [(c, s, 0), (-s, c, 0), (0, 0, 1)]
    T[:3, 3] = shape.wrist + T[:3, 1] * again.shape.palm_length / 2
    pose = make_pose([0.05, -0.02, 0.6], [0.4, -0.3, 0.8, 0.1], FIST.ravel())
    T_camera_palm = HandModel(shape).transforms(pose)[0] @ T
    angles = FIST - np.array([(0, 0, 0, 0)] + [(turn, 0, 0, 0)] * 4)
    same = make_pose(T_camera_palm[:3, 3], quaternion_from_matrix(T_camera_palm[:3, :3]), angles.ravel())
    ours, theirs = skin.at(pose), again.at(same)
    assert distances(ours, theirs).max() < 2e-6
    assert distances(theirs, ours).max() < 2e-6
    assert again.to_trimesh(theirs).is_watertight
    assert again.to_trimesh(theirs).volume == pytest.approx(skin.to_trimesh(ours).volume, rel=1e-4)


def test_a_file_beside_the_rig_maps_unknown_names(own_glb: Path, tmp_path: Path) -> None:
    """Joints have the names bone0, bone1, ...; the bend of the fingers gives the side."""
    document, binary = parts(own_glb)
    names = {name: f"bone{n}" for n, name in enumerate(JOINT_NAMES)}
    for node in document["nodes"]:
        node["name"] = names.get(node.get("name"), "other")
    path = write_gltf(tmp_path / "renamed.gltf", document, binary)
    with pytest.raises(InputError, match=r"mapping from thumb_0.*joints\.json.*bone0, bone1"):
        load_skin(path)
    mapping = mapping_path(path)
    mapping.write_text(json.dumps(names))
    skin, expected = load_skin(path), load_skin(own_glb)
    assert skin.shape.side == "right"
    np.testing.assert_allclose(skin.shape.lengths, expected.shape.lengths, rtol=1e-5)
    np.testing.assert_allclose(skin.rest, expected.rest, rtol=0, atol=1e-6)

    for spoilt, message in (
        ({name: bone for name, bone in names.items() if name != "index_2"}, "missing are index_2"),
        ({**names, "index_2": "toe"}, "no joint toe"),
        (["index_0"], "one JSON object"),
    ):
        mapping.write_text(json.dumps(spoilt))
        with pytest.raises(InputError, match=message):
            load_skin(path)


@pytest.mark.parametrize(("factor", "unit"), [(100, 0.01), (1000, 0.001), (10, 0.1), (1, 1.0)])
def test_other_units_are_recognised_by_the_size_of_a_hand(
    own_glb: Path, tmp_path: Path, factor: float, unit: float
) -> None:
    document, binary = parts(own_glb)
    document["nodes"].append({"name": "root", "children": [0], "scale": [factor] * 3})
    path = write_gltf(tmp_path / "scaled.gltf", document, binary)
    hand = load_hand(path)
    assert hand.rig is not None
    assert hand.rig.unit == unit
    np.testing.assert_allclose(Skin.of(hand).rest, load_skin(own_glb).rest, rtol=0, atol=1e-6)
    with pytest.raises(InputError, match="50 to 500 mm long"):
        read_rigged_hand(path, unit=3 * unit)


def test_a_mirrored_node_gives_the_other_side(own_glb: Path, tmp_path: Path) -> None:
    document, binary = parts(own_glb)
    document["nodes"].append({"name": "root", "children": [0], "scale": [-1, 1, 1]})
    left, right = load_skin(write_gltf(tmp_path / "mirrored.gltf", document, binary)), load_skin(own_glb)
    assert (left.shape.side, right.shape.side) == ("left", "right")
    np.testing.assert_allclose(left.rest[np.lexsort(left.rest.T)], (right.rest * [-1, 1, 1])[_order(right)], atol=1e-6)
    assert left.to_trimesh(left.rest).volume == pytest.approx(right.to_trimesh(right.rest).volume, rel=1e-4)


def _order(skin: Skin) -> NDArray[np.int64]:
    return np.lexsort((skin.rest * [-1, 1, 1]).T)


def test_an_open_wrist_is_closed(own_glb: Path, tmp_path: Path) -> None:
    rig = next(read_rigs(own_glb))
    kept = (rig.vertices[rig.faces, 1] > -0.03).all(axis=1)
    weights = np.zeros((len(rig.vertices), len(rig.names)))
    np.add.at(weights, (np.arange(len(weights))[:, None], rig.bound), rig.weights)
    path = write_rig(
        tmp_path / "open.glb", rig.vertices, rig.faces[kept], weights, list(rig.names), rig.parents, rig.joints
    )
    skin = load_skin(path, "right")
    assert skin.to_trimesh(skin.rest).is_watertight
    assert skin.to_trimesh(skin.rest).volume > 0
    np.testing.assert_allclose(skin.weights.sum(axis=1), 1)


@pytest.mark.parametrize("letter", ["R", "L"])
def test_a_makehuman_hand(real_data: Path, tmp_path: Path, letter: str) -> None:
    """A CC0 mesh has metacarpals, eight influences a vertex, decimetres and an open wrist."""
    with np.load(real_data / "meshes" / "makehuman-hand" / f"hand_{letter}.npz") as hand:
        heads, tails, names = hand["head"] * 0.1, hand["tail"] * 0.1, [str(name) for name in hand["bones"]]
    path = write_makehuman_rig(tmp_path / "hand.glb", real_data, letter)
    skin = load_skin(path)
    assert skin.shape.side == {"R": "right", "L": "left"}[letter]
    phalanges = [[names.index(f"finger{f}-{k}.{letter}") for k in (1, 2, 3)] for f in range(1, 6)]
    bones = np.linalg.norm(tails - heads, axis=-1)[phalanges]
    np.testing.assert_allclose(skin.shape.lengths[:, :2], bones[:, :2], rtol=0, atol=0.5e-3)
    # Its bones end inside the fingertip; our last length ends at its skin.
    assert np.all((skin.shape.lengths[:, 2] - bones[:, 2] > -1e-3) & (skin.shape.lengths[:, 2] - bones[:, 2] < 8e-3))

    model = HandModel(skin.shape)
    fist = make_pose(np.zeros(3), (1, 0, 0, 0), FIST.ravel())
    vertices = skin.at(fist)
    tips = model.endpoints(fist)[3::4]
    gaps = np.abs(skin.to_trimesh(vertices).nearest.on_surface(tips)[1])
    assert gaps.max() < 1.5e-3
    for finger in range(1, 5):
        joint = model.joints(fist)[body_of(finger, 1)]
        assert np.linalg.norm(vertices - joint, axis=-1).min() > 0.6 * skin.shape.radii[finger, 1]
    # The skin built from the measured sizes is about as large.
    assert skin.to_trimesh(skin.rest).is_watertight
    built = Skin.of(skin.shape.with_(rig=None))
    straight = make_pose(np.zeros(3), (1, 0, 0, 0), np.zeros(20))
    assert distances(built.at(straight), skin.at(straight)).mean() < 4e-3


def test_only_the_hand_of_a_body_is_kept(own_glb: Path, tmp_path: Path) -> None:
    """The skin of a forearm bone above the wrist is removed."""
    skin = Skin.of(DEFAULT)
    rig = next(read_rigs(own_glb))
    weights = np.zeros((len(rig.vertices), 17))
    np.add.at(weights, (np.arange(len(weights))[:, None], rig.bound), rig.weights)
    arm = rig.vertices[:, 1] < -0.03
    weights[arm] = np.eye(17)[16]
    heads = np.concatenate([rig.joints, [rig.joints[0] - [0, 0.1, 0]]])
    parents = np.concatenate([rig.parents, [-1]])
    parents[0] = 16
    path = write_rig(tmp_path / "arm.glb", rig.vertices, rig.faces, weights, [*rig.names, "forearm"], parents, heads)
    kept = load_skin(path, side="right")
    assert len(kept.rest) == np.count_nonzero(~arm) + 1  # the centre of the closed cut
    assert len(kept.faces) < len(skin.faces)
    np.testing.assert_allclose(kept.weights.sum(axis=1), 1)
