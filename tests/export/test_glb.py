"""Animated GLB files: arrays that pygltflib reads give the vertices of our skin."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from depthtrack.errors import InputError, MissingExtraError
from depthtrack.export.registry import export_joints
from depthtrack.hand.shape import HandShape, Side
from depthtrack.hand.skin.mesh import Skin
from depthtrack.types import Array
from tests.support.tracks import moving_poses, track_of

pygltflib = pytest.importorskip("pygltflib", reason="glTF needs the extra: pip install 'depthtrack[gltf]'")

COMPONENTS = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}


def array(gltf: Any, number: int) -> Array:
    """Return an accessor (count, width) by the rules of the specification."""
    accessor = gltf.accessors[number]
    view, width = gltf.bufferViews[accessor.bufferView], WIDTHS[accessor.type]
    start = view.byteOffset + (accessor.byteOffset or 0)
    kind = np.dtype(COMPONENTS[accessor.componentType])
    data = gltf.binary_blob()[start : start + accessor.count * width * kind.itemsize]
    return np.frombuffer(data, kind).reshape(accessor.count, width).astype(np.float64)


def skinned(gltf: Any, key: int) -> Array:
    """Return the vertices at a key of the animation."""
    (animation,) = gltf.animations
    outputs = [array(gltf, sampler.output) for sampler in animation.samplers]
    moves = {(channel.target.node, channel.target.path): outputs[channel.sampler] for channel in animation.channels}
    world: dict[int, Array] = {}

    def place(node: int, parent: Array) -> None:
        still = gltf.nodes[node]
        turn = moves[node, "rotation"][key] if (node, "rotation") in moves else still.rotation or [0, 0, 0, 1]
        move = moves[node, "translation"][key] if (node, "translation") in moves else still.translation
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = Rotation.from_quat(turn).as_matrix(), move
        world[node] = parent @ T
        for child in gltf.nodes[node].children:
            place(child, world[node])

    place(gltf.scenes[0].nodes[0], np.eye(4))
    (skin,), (primitive,) = gltf.skins, gltf.meshes[0].primitives
    inverse = array(gltf, skin.inverseBindMatrices).reshape(-1, 4, 4).swapaxes(1, 2)
    joints = np.array([world[node] for node in skin.joints]) @ inverse
    rest = array(gltf, primitive.attributes.POSITION)
    numbers = array(gltf, primitive.attributes.JOINTS_0).astype(int)
    weights = array(gltf, primitive.attributes.WEIGHTS_0)
    blended = np.einsum("vk,vkij->vij", weights, joints[numbers])
    return np.einsum("vij,vj->vi", blended[:, :3, :3], rest) + blended[:, :3, 3]


@pytest.mark.parametrize("side", ["right", "left"])
def test_the_skin_moves_as_ours(tmp_path: Path, side: Side) -> None:
    poses = moving_poses(5)
    poses[[0, 3]] = np.nan
    track = track_of(poses, HandShape(side=side), start=1.7e9)
    export_joints(tmp_path / "a.glb", track)
    gltf = pygltflib.GLTF2().load(tmp_path / "a.glb")
    times = array(gltf, gltf.animations[0].samplers[0].input)[:, 0]
    np.testing.assert_allclose(times, np.array([1, 2, 4]) / 30, atol=1e-6)
    skin = Skin.of(track.hand)
    for key, frame in enumerate((1, 2, 4)):
        np.testing.assert_allclose(skinned(gltf, key) * [1, -1, -1], skin.at(poses[frame]), atol=2e-6)
    (clock,) = (accessor for accessor in gltf.accessors if accessor.count == 3 and accessor.type == "SCALAR")
    assert (clock.min, clock.max) == ([pytest.approx(1 / 30)], [pytest.approx(4 / 30)])


def test_trimesh_opens_the_mesh(tmp_path: Path) -> None:
    track = track_of(moving_poses(2))
    export_joints(tmp_path / "a.glb", track)
    (mesh,) = trimesh.load_scene(tmp_path / "a.glb").geometry.values()
    skin = Skin.of(track.hand)
    assert len(mesh.faces) == len(skin.faces)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(skin.to_trimesh(skin.rest).volume, rel=1e-4)


def test_quaternions_keep_their_sign_and_names_are_ours(tmp_path: Path) -> None:
    export_joints(tmp_path / "a.glb", track_of(moving_poses(60)))
    gltf = pygltflib.GLTF2().load(tmp_path / "a.glb")
    assert [node.name for node in gltf.nodes[:4]] == ["wrist", "thumb_0", "thumb_1", "thumb_2"]
    for sampler in gltf.animations[0].samplers[1:]:
        turns = array(gltf, sampler.output)
        np.testing.assert_allclose(np.linalg.norm(turns, axis=1), 1, atol=1e-6)
        assert np.all(np.sum(turns[1:] * turns[:-1], axis=1) > 0)


def test_a_run_without_a_pose_or_the_library_is_rejected(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="no frame of the run has a pose"):
        export_joints(tmp_path / "a.glb", track_of(np.full((2, 27), np.nan)))
    monkeypatch.setitem(sys.modules, "pygltflib", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'depthtrack\[gltf\]'"):
        export_joints(tmp_path / "a.glb", track_of(moving_poses(1)))
    assert list(tmp_path.iterdir()) == []
