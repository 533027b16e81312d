"""Write a skin as a rigged GLB file: mesh, 16 joints, five fingertips, weights, animation.

Needs the optional library pygltflib: `pip install 'depthtrack[gltf]'`. Plain meshes go through `Skin.to_trimesh`.
"""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from depthtrack.files import replace_atomically
from depthtrack.geometry.rotations import continuous
from depthtrack.hand.compiled_kinematics import BODY_COUNT
from depthtrack.hand.kinematics import JOINT_NAMES, HandModel, body_of
from depthtrack.hand.pose import FINGERS
from depthtrack.hand.rest_rotations import JOINT_PARENTS
from depthtrack.hand.rig.gltf_document import gltf_library
from depthtrack.hand.skin.mesh import Skin
from depthtrack.types import Array

_FLOAT, _UINT16, _UINT32 = 5126, 5123, 5125
_VERTEX_DATA, _INDEX_DATA = 34962, 34963
_SKIN_COLOUR = (0.80, 0.58, 0.46)


def export_glb(skin: Skin, path: Path) -> None:
    """Write the skin at rest as GLB: metres, palm frame, y towards the fingers.

    Joints are named as `kinematics.JOINT_NAMES`; `thumb_tip` to `little_tip` hang on the last ones. The joint `wrist`
    is at the wrist.

    Raises:
        InputError: if the file cannot be written.
        MissingExtraError: if pygltflib is not installed.
    """
    _write(skin, path, _relative(_rest_joints(skin))[None], None)


def export_animation(skin: Skin, path: Path, times: Array, poses: Array, T_world_camera: Array) -> None:
    """Write the skin as GLB with an animation of the joints of `export_glb`.

    times: (K,) increasing, s.
    poses: (K, 27) at these times, camera frame; without an animation player the first one is shown.
    T_world_camera: (4, 4) to the frame of the file, metres.

    Raises:
        InputError: if the file cannot be written.
        MissingExtraError: if pygltflib is not installed.
    """
    joints = T_world_camera @ _joints(skin, HandModel(skin.shape).transforms(poses))
    _write(skin, path, _relative(joints), times)


def _write(skin: Skin, path: Path, local: Array, times: Array | None) -> None:
    """Write a file.

    local: (K, 16, 4, 4) transform of each joint in its parent's frame, metres.
    times: (K,) s, of an animation; None for a still hand.
    """
    library = gltf_library()
    gltf = library.GLTF2(asset=library.Asset(version="2.0", generator="depthtrack"))
    blob = _Blob(library, gltf)
    gltf.materials = [
        library.Material(
            name="skin",
            pbrMetallicRoughness=library.PbrMetallicRoughness(
                baseColorFactor=[*_SKIN_COLOUR, 1.0], metallicFactor=0.0, roughnessFactor=0.7
            ),
        )
    ]
    gltf.meshes = [library.Mesh(name="hand", primitives=[_primitive(library, blob, skin)])]
    inverse = np.linalg.inv(_rest_joints(skin)).swapaxes(1, 2).reshape(-1, 16)  # column by column, as glTF stores them
    inverse_bind = blob.add(inverse.astype("<f4"), "MAT4", _FLOAT, None)
    gltf.nodes = _nodes(library, skin, local[0])
    gltf.skins = [library.Skin(joints=list(range(BODY_COUNT)), inverseBindMatrices=inverse_bind, skeleton=0)]
    gltf.nodes.append(library.Node(name="hand", mesh=0, skin=0))
    gltf.scenes = [library.Scene(nodes=[0, len(gltf.nodes) - 1])]
    gltf.scene = 0
    if times is not None:
        gltf.animations = [_animation(library, blob, local, times)]
    gltf.buffers = [library.Buffer(byteLength=len(blob.data))]
    gltf.set_binary_blob(bytes(blob.data))
    with replace_atomically(path) as temporary:
        gltf.save_binary(temporary)


def _joints(skin: Skin, T: Array) -> Array:
    """Return the frames of joints (..., 16, 4, 4): bodies T with the palm moved to the wrist."""
    joints = T.copy()
    joints[..., 0, :3, 3] += joints[..., 0, :3, :3] @ skin.shape.wrist
    return joints


def _rest_joints(skin: Skin) -> Array:
    """Return T_palm_joint (16, 4, 4) at rest."""
    return _joints(skin, np.asarray(np.linalg.inv(skin.T_body_rest)))


def _relative(joints: Array) -> Array:
    """Return the transforms of joints (..., 16, 4, 4) in the frames of their parents."""
    local = joints.copy()
    local[..., 1:, :, :] = np.linalg.inv(joints[..., list(JOINT_PARENTS[1:]), :, :]) @ joints[..., 1:, :, :]
    return local


def _primitive(library: Any, blob: "_Blob", skin: Skin) -> Any:
    """Return the mesh at rest with the weights of its joints."""
    influences = int(np.ceil((skin.weights > 0).sum(axis=1).max() / 4)) * 4
    strongest = np.argsort(-skin.weights, axis=1, kind="stable")[:, :influences]
    weights = np.take_along_axis(skin.weights, strongest, axis=1).astype(np.float32)
    attributes = {
        "POSITION": blob.add(skin.rest.astype("<f4"), "VEC3", _FLOAT, _VERTEX_DATA),
        "NORMAL": blob.add(skin.normals(skin.rest).astype("<f4"), "VEC3", _FLOAT, _VERTEX_DATA),
    }
    for s in range(influences // 4):
        four = slice(4 * s, 4 * s + 4)
        used = np.where(weights[:, four] > 0, strongest[:, four], 0)
        attributes[f"JOINTS_{s}"] = blob.add(used.astype("<u2"), "VEC4", _UINT16, _VERTEX_DATA)
        attributes[f"WEIGHTS_{s}"] = blob.add(weights[:, four].astype("<f4"), "VEC4", _FLOAT, _VERTEX_DATA)
    indices = blob.add(skin.faces.astype("<u4").reshape(-1, 1), "SCALAR", _UINT32, _INDEX_DATA)
    return library.Primitive(attributes=library.Attributes(**attributes), indices=indices, material=0)


def _nodes(library: Any, skin: Skin, local: Array) -> list[Any]:
    """Return the tree of 16 joints, placed by `local` (16, 4, 4), then the five fingertips."""
    lengths = HandModel(skin.shape).lengths
    rotations = Rotation.from_matrix(local[:, :3, :3]).as_quat()
    nodes = [
        library.Node(name=name, children=[], translation=T[:3, 3].tolist(), rotation=rotation.tolist())
        for name, T, rotation in zip(JOINT_NAMES, local, rotations, strict=True)
    ]
    for joint, parent in enumerate(JOINT_PARENTS):
        if parent >= 0:
            nodes[parent].children.append(joint)
    for finger, name in enumerate(FINGERS):
        nodes[body_of(finger, 2)].children.append(len(nodes))
        nodes.append(library.Node(name=f"{name}_tip", translation=[0.0, float(lengths[finger, 2]), 0.0]))
    return nodes


def _animation(library: Any, blob: "_Blob", local: Array, times: Array) -> Any:
    """Return the motion of the wrist and the rotations of all joints."""
    quaternions = continuous(Rotation.from_matrix(local[..., :3, :3].reshape(-1, 3, 3)).as_quat().reshape(-1, 16, 4))
    clock = blob.add(times.astype("<f4").reshape(-1, 1), "SCALAR", _FLOAT, None)
    moves = [(0, "translation", blob.add(local[:, 0, :3, 3].astype("<f4"), "VEC3", _FLOAT, None))]
    for joint in range(BODY_COUNT):
        turned = np.ascontiguousarray(quaternions[:, joint], dtype="<f4")
        moves.append((joint, "rotation", blob.add(turned, "VEC4", _FLOAT, None)))
    sampler = partial(library.AnimationSampler, input=clock, interpolation="LINEAR")
    return library.Animation(
        name="run",
        samplers=[sampler(output=output) for _, _, output in moves],
        channels=[
            library.AnimationChannel(sampler=n, target=library.AnimationChannelTarget(node=joint, path=moved))
            for n, (joint, moved, _) in enumerate(moves)
        ],
    )


class _Blob:
    """The binary part of a GLB file, and the accessors into it."""

    def __init__(self, library: Any, gltf: Any) -> None:
        self.library, self.gltf, self.data = library, gltf, bytearray()

    def add(self, array: NDArray[Any], kind: str, component: int, target: int | None) -> int:
        """Append an array (count, width) and return the index of its accessor."""
        view = self.library.BufferView(buffer=0, byteOffset=len(self.data), byteLength=array.nbytes, target=target)
        accessor = self.library.Accessor(
            bufferView=len(self.gltf.bufferViews),
            componentType=component,
            count=len(array),
            type=kind,
            min=array.min(axis=0).tolist(),
            max=array.max(axis=0).tolist(),
        )
        self.gltf.bufferViews.append(view)
        self.gltf.accessors.append(accessor)
        self.data += array.tobytes() + b"\0" * (-array.nbytes % 4)
        return len(self.gltf.accessors) - 1
