"""Rigged hands from glTF files: our own skins come back the same, other rigs fit, bad files get one sentence."""

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from depthtrack.errors import InputError
from depthtrack.geometry.rotations import quaternion_from_matrix
from depthtrack.hand.kinematics import JOINT_NAMES, HandModel, body_of
from depthtrack.hand.pose import FINGERS, make_pose
from depthtrack.hand.rig.rig_joints import finger_joints, finger_of, side_of
from depthtrack.hand.shape import HandShape, Side
from depthtrack.hand.skin.mesh import Skin
from depthtrack.types import Array

pygltflib = pytest.importorskip("pygltflib", reason="rigged hands need the extra: pip install 'depthtrack[gltf]'")

from depthtrack.hand.rig.gltf import read_rigs  # noqa: E402
from depthtrack.hand.rig.gltf_writer import export_glb  # noqa: E402
from depthtrack.hand.rig.rig_import import load_skin  # noqa: E402

DEFAULT = HandShape()
FIST = np.radians([(12, 22, 45, 45), (4, 80, 100, 60), (0, 85, 100, 60), (-4, 85, 100, 60), (-8, 85, 100, 60)])


@pytest.fixture(scope="module")
def own_glb(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("rig") / "own.glb"
    export_glb(Skin.of(DEFAULT), path)
    return path


def parts(path: Path) -> tuple[dict[str, Any], bytes]:
    """JSON and binary part of a GLB file."""
    data = path.read_bytes()
    length = struct.unpack("<I", data[12:16])[0]
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def write_gltf(path: Path, document: dict[str, Any], binary: bytes, uri: str | None = None) -> Path:
    """The same as text, its buffer inline or at `uri`."""
    inline = "data:application/octet-stream;base64," + base64.b64encode(binary).decode()
    document["buffers"][0] = {"byteLength": len(binary), "uri": uri or inline}
    path.write_text(json.dumps(document))
    return path


def distances(cloud: Array, points: Array) -> Array:
    return np.asarray(cKDTree(cloud).query(points)[0])


@pytest.mark.parametrize("side", ["right", "left"])
def test_our_own_skin_comes_back_in_every_pose(tmp_path: Path, side: Side) -> None:
    """Exported and read again, both meshes lie on each other in a fist somewhere in space."""
    shape = DEFAULT.with_(side=side, scale=1.1)
    skin, path = Skin.of(shape), tmp_path / "hand.glb"
    export_glb(skin, path)
    again = load_skin(path)
    assert again.shape.side == side

    np.testing.assert_allclose(again.shape.lengths, shape.lengths * 1.1, rtol=0, atol=0.2e-3)
    np.testing.assert_allclose(again.shape.radii, shape.radii * 1.1, rtol=0.12)
    for name in ("palm_breadth", "palm_length", "palm_thickness", "wrist_breadth", "wrist_thickness"):
        assert getattr(again.shape, name) == pytest.approx(getattr(shape, name) * 1.1, rel=0.2)

    # Its palm frame points y at the middle knuckle, so it is turned a little, and its abductions count from there.
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


def test_exported_file_is_standard_gltf(own_glb: Path) -> None:
    document, binary = parts(own_glb)
    assert document["asset"]["version"] == "2.0"
    assert [node["name"] for node in document["nodes"][:16]] == list(JOINT_NAMES)
    assert len(binary) >= document["buffers"][0]["byteLength"]
    from trimesh import load_mesh

    mesh = load_mesh(own_glb)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(Skin.of(DEFAULT).to_trimesh(Skin.of(DEFAULT).rest).volume, rel=1e-4)


def test_text_files_with_inline_or_neighbouring_buffers(own_glb: Path, tmp_path: Path) -> None:
    document, binary = parts(own_glb)
    expected = load_skin(own_glb).rest
    np.testing.assert_array_equal(load_skin(write_gltf(tmp_path / "inline.gltf", document, binary)).rest, expected)
    (tmp_path / "a hand.bin").write_bytes(binary)
    beside = write_gltf(tmp_path / "beside.gltf", document, binary, "a%20hand.bin")
    np.testing.assert_array_equal(load_skin(beside).rest, expected)


def test_other_units_and_unknown_names(own_glb: Path, tmp_path: Path) -> None:
    """A rig in centimetres whose joints are called bone0, bone1, ...; its side shows in how the fingers bend."""
    document, binary = parts(own_glb)
    names = {name: f"bone{n}" for n, name in enumerate(JOINT_NAMES)}
    for node in document["nodes"]:
        node["name"] = names.get(node.get("name"), "other")
    document["nodes"].append({"name": "root", "children": [0], "scale": [100, 100, 100]})
    path = write_gltf(tmp_path / "renamed.gltf", document, binary)
    with pytest.raises(InputError, match=r"mapping from thumb_0.*bone0, bone1"):
        load_skin(path)
    mapping = tmp_path / "mapping.json"
    mapping.write_text(json.dumps(names))
    with pytest.raises(InputError, match=r"50 to 500 mm long.*unit=0\.01 may fit"):
        load_skin(path, mapping=mapping)
    skin, expected = load_skin(path, mapping=mapping, unit=0.01), load_skin(own_glb)
    assert skin.shape.side == "right"
    np.testing.assert_allclose(skin.shape.lengths, expected.shape.lengths, rtol=1e-5)
    np.testing.assert_allclose(skin.rest, expected.rest, rtol=0, atol=1e-6)

    with pytest.raises(InputError, match="missing are index_2"):
        load_skin(path, mapping={name: bone for name, bone in names.items() if name != "index_2"})
    with pytest.raises(InputError, match="no joint toe"):
        load_skin(path, mapping={**names, "index_2": "toe"})
    mapping.write_text('["index_0"]')
    with pytest.raises(InputError, match="one JSON object"):
        load_skin(path, mapping=mapping)


@pytest.mark.parametrize("letter", ["R", "L"])
def test_a_makehuman_hand(real_data: Path, tmp_path: Path, letter: str) -> None:
    """A CC0 mesh made by others: names, metacarpals, eight influences a vertex, decimetres, an open wrist."""
    source = real_data / "meshes" / "makehuman-hand" / f"hand_{letter}.npz"
    with np.load(source) as hand:
        heads, tails, names = hand["head"] * 0.1, hand["tail"] * 0.1, [str(name) for name in hand["bones"]]
        path = write_rig(
            tmp_path / "hand.glb",
            hand["vertices_dm"],
            hand["triangles"],
            hand["weights"],
            names,
            hand["parent"],
            hand["head"],
        )
    skin = load_skin(path, unit=0.1)
    assert skin.shape.side == {"R": "right", "L": "left"}[letter]
    phalanges = [[names.index(f"finger{f}-{k}.{letter}") for k in (1, 2, 3)] for f in range(1, 6)]
    bones = np.linalg.norm(tails - heads, axis=-1)[phalanges]
    np.testing.assert_allclose(skin.shape.lengths[:, :2], bones[:, :2], rtol=0, atol=0.5e-3)
    # Bones end inside the fingertip, our last length reaches its skin.
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
    # Our own flesh on the sizes measured there is about as large.
    built = Skin.of(skin.shape)
    straight = make_pose(np.zeros(3), (1, 0, 0, 0), np.zeros(20))
    assert distances(built.at(straight), skin.at(straight)).mean() < 4e-3


def write_rig(
    path: Path,
    vertices: Array,
    faces: NDArray[np.int64],
    weights: Array,
    names: list[str],
    parents: NDArray[np.int64],
    heads: Array,
) -> Path:
    """A GLB as other programs write it: unrotated joints at the bones' heads, two sets of weights, bytes and shorts."""
    strongest = np.argsort(-weights, axis=1, kind="stable")[:, :8]
    share = np.take_along_axis(weights, strongest, axis=1)
    inverse_bind = np.tile(np.eye(4), (len(names), 1, 1))
    inverse_bind[:, 3, :3] = -heads  # column by column
    arrays = {
        "POSITION": (vertices.astype("<f4"), "VEC3", 5126),
        "JOINTS_0": (strongest[:, :4].astype("<u1"), "VEC4", 5121),
        "JOINTS_1": (strongest[:, 4:].astype("<u1"), "VEC4", 5121),
        "WEIGHTS_0": (np.round(share[:, :4] * 65535).astype("<u2"), "VEC4", 5123),
        "WEIGHTS_1": (np.round(share[:, 4:] * 65535).astype("<u2"), "VEC4", 5123),
        "indices": (faces.astype("<u4").reshape(-1, 1), "SCALAR", 5125),
        "inverse_bind": (inverse_bind.reshape(-1, 16).astype("<f4"), "MAT4", 5126),
    }
    blob, views, accessors = b"", [], []
    for n, (array, kind, component) in enumerate(arrays.values()):
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": array.nbytes})
        accessors.append({"bufferView": n, "componentType": component, "count": len(array), "type": kind})
        if component == 5123:
            accessors[-1]["normalized"] = True
        blob += array.tobytes() + b"\0" * (-array.nbytes % 4)
    nodes: list[dict[str, Any]] = []
    for n, name in enumerate(names):
        parent = int(parents[n])
        offset = heads[n] - (heads[parent] if parent >= 0 else 0)
        nodes.append({"name": name, "translation": offset.tolist(), "children": np.nonzero(parents == n)[0].tolist()})
    nodes.append({"mesh": 0, "skin": 0})
    attributes = {name: n for n, name in enumerate(arrays) if name.isupper()}
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(blob)}],
        "bufferViews": views,
        "accessors": accessors,
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 5}]}],
        "nodes": nodes,
        "skins": [{"joints": list(range(len(names))), "inverseBindMatrices": 6}],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    header = b"glTF" + struct.pack("<II", 2, 28 + len(text) + len(blob))
    path.write_bytes(
        header + struct.pack("<I", len(text)) + b"JSON" + text + struct.pack("<I", len(blob)) + b"BIN\0" + blob
    )
    return path


NAMINGS = {
    "rigify": "thumb.01.R f_index.02.R DEF-f_pinky.03.R",
    "makehuman": "finger1-1.R finger2-2.R finger5-3.R",
    "unreal": "thumb_01_r index_02_r pinky_03_r",
    "mixamo": "mixamorig:RightHandThumb1 mixamorig:RightHandIndex2 mixamorig:RightHandPinky3",
    "unity": "RightThumbProximal RightIndexIntermediate RightLittleDistal",
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
    """WebXR's 25 joints with no tree at all: words order each finger, metacarpals and tips fall away."""
    words = ("tip", "phalanx-distal", "phalanx-intermediate", "phalanx-proximal", "metacarpal")
    fingers = ("thumb", "index-finger", "middle-finger", "ring-finger", "pinky-finger")
    names = [f"{f}-{w}" for f in fingers for w in words if (f, w) != ("thumb", "phalanx-intermediate")] + ["wrist"]
    found = finger_joints(names, np.full(len(names), -1), np.ones(len(names)), None)
    assert [names[j] for j in found[0]] == ["thumb-metacarpal", "thumb-phalanx-proximal", "thumb-phalanx-distal"]
    assert [names[j] for j in found[2]] == [f"middle-finger-{w}" for w in words[3:0:-1]]


def test_unloaded_fourth_joints_are_tips_and_sides_are_kept_apart() -> None:
    names = [f"{side}Hand{f.title()}{k}" for side in ("Left", "Right") for f in FINGERS for k in (1, 2, 3, 4)]
    parents = np.array([n - 1 if n % 4 else -1 for n in range(len(names))])
    loads = np.array([0.0 if n % 4 == 3 else 1.0 for n in range(len(names))])
    found = finger_joints(names, parents, loads, "right")
    assert [names[j] for j in found[3]] == ["RightHandRing1", "RightHandRing2", "RightHandRing3"]
    with pytest.raises(InputError, match="both hands"):
        finger_joints(names, parents, loads, None)


def _no_skin(document: dict[str, Any]) -> None:
    del document["skins"]
    del document["nodes"][-1]["skin"]


def _absurd_count(document: dict[str, Any]) -> None:
    document["accessors"][0]["count"] = 10**12


def _absurd_indices(document: dict[str, Any]) -> None:
    document["accessors"][document["meshes"][0]["primitives"][0]["indices"]]["count"] = 10**12


def _repeated(document: dict[str, Any]) -> None:
    document["meshes"][0]["primitives"] *= 300


def _beyond_the_end(document: dict[str, Any]) -> None:
    document["bufferViews"][0]["byteLength"] = 10**9
    document["accessors"][0]["count"] = 10**6


def _unbound(document: dict[str, Any]) -> None:
    del document["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"]
    del document["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"]


def _circle(document: dict[str, Any]) -> None:
    document["nodes"][3]["children"] = [1]


def _compressed(document: dict[str, Any]) -> None:
    document["extensionsRequired"] = ["KHR_draco_mesh_compression"]


def _no_little_finger(document: dict[str, Any]) -> None:
    document["nodes"][14]["name"] = "bone"


def _no_bind_pose(document: dict[str, Any]) -> None:
    del document["skins"][0]["inverseBindMatrices"]


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (_no_skin, "no skinned mesh"),
        (_absurd_count, "at most 2000000 vertices"),
        (_absurd_indices, r"1 to \d+ elements"),
        (_repeated, "at most 2000000 vertices, found 2252400"),
        (_beyond_the_end, "cut short or damaged"),
        (_unbound, "lacks JOINTS_0"),
        (_circle, "circle"),
        (_compressed, "KHR_draco_mesh_compression"),
        (_no_little_finger, r"little \(2 joints\)"),
        (_no_bind_pose, "inverse bind matrices"),
    ],
)
def test_unusable_files_get_one_sentence(own_glb: Path, tmp_path: Path, spoil: Any, message: str) -> None:
    document, binary = parts(own_glb)
    spoil(document)
    path = write_gltf(tmp_path / "spoilt.gltf", document, binary)
    with pytest.raises(InputError, match=message) as caught:
        load_skin(path)
    assert str(path) in str(caught.value)


def test_buffers_outside_the_folder_are_refused(own_glb: Path, tmp_path: Path) -> None:
    document, binary = parts(own_glb)
    (tmp_path / "outside.bin").write_bytes(binary)
    (tmp_path / "rig").mkdir()
    for uri in ("../outside.bin", str(tmp_path / "outside.bin"), "..%2Foutside.bin"):
        with pytest.raises(InputError, match="outside its own folder"):
            load_skin(write_gltf(tmp_path / "rig" / "hand.gltf", document, binary, uri))
    with pytest.raises(InputError, match="cannot read"):
        load_skin(tmp_path / "absent.glb")


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damage_never_ends_in_a_traceback(own_glb: Path, tmp_path: Path, data: st.DataObject) -> None:
    """Cut anywhere, or with any number or name of its description replaced: read, or refused with a sentence."""
    path = tmp_path / "damaged.gltf"
    if data.draw(st.booleans()):
        whole = own_glb.read_bytes()
        path.write_bytes(whole[: data.draw(st.integers(0, len(whole) - 1))])
    else:
        document, binary = parts(own_glb)
        write_gltf(path, document, binary)
        where: Any = document
        while True:
            key = data.draw(st.sampled_from(sorted(where) if isinstance(where, dict) else range(len(where))))
            if not isinstance(where[key], dict | list) or not where[key] or data.draw(st.integers(0, 4)) == 0:
                break
            where = where[key]
        where[key] = data.draw(st.sampled_from([None, -1, 10**15, 1.5, "x", [], {}, [0], float("nan")]))
        path.write_text(json.dumps(document))
    try:
        skin = load_skin(path)
    except InputError:
        return
    assert np.isfinite(skin.rest).all()
    assert np.isfinite(skin.T_body_rest).all()


def test_only_the_hand_of_a_body_is_kept(own_glb: Path, tmp_path: Path) -> None:
    """A forearm bone above the wrist, with skin of its own, stays behind."""
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
    assert len(kept.rest) == np.count_nonzero(~arm)
    assert len(kept.faces) < len(skin.faces)
    np.testing.assert_allclose(kept.weights.sum(axis=1), 1)
