"""Write a skin as a rigged GLB file: mesh, 16 joints, five fingertips, weights.

Needs the optional library pygltflib: `pip install 'depthtrack[gltf]'`. Plain meshes go through `Skin.to_trimesh`.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from depthtrack.files import replace_atomically
from depthtrack.hand.compiled_kinematics import BODY_COUNT
from depthtrack.hand.kinematics import JOINT_NAMES, HandModel, body_of
from depthtrack.hand.pose import FINGERS
from depthtrack.hand.rig.gltf_document import gltf_library
from depthtrack.hand.skin.mesh import Skin
from depthtrack.types import Array

_FLOAT, _UINT16, _UINT32 = 5126, 5123, 5125
_VERTEX_DATA, _INDEX_DATA = 34962, 34963


def export_glb(skin: Skin, path: Path) -> None:
    """Write the skin at rest as GLB: metres, palm frame, y towards the fingers.

    Joints are named as `kinematics.JOINT_NAMES`; `thumb_tip` to `little_tip` hang on the last ones. The joint `wrist`
    is at the wrist.

    Raises:
        InputError: if the file cannot be written.
        MissingExtraError: if pygltflib is not installed.
    """
    library = gltf_library()
    rest = _joint_transforms(skin)
    gltf = library.GLTF2(asset=library.Asset(version="2.0", generator="depthtrack"))
    blob = _Blob(library, gltf)

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
    inverse = np.linalg.inv(rest).swapaxes(1, 2).reshape(-1, 16)  # column by column, as glTF stores matrices
    inverse_bind = blob.add(inverse.astype("<f4"), "MAT4", _FLOAT, None)

    primitive = library.Primitive(attributes=library.Attributes(**attributes), indices=indices)
    gltf.meshes = [library.Mesh(name="hand", primitives=[primitive])]
    gltf.nodes = _nodes(library, skin, rest)
    gltf.skins = [library.Skin(joints=list(range(BODY_COUNT)), inverseBindMatrices=inverse_bind, skeleton=0)]
    gltf.nodes.append(library.Node(name="hand", mesh=0, skin=0))
    gltf.scenes = [library.Scene(nodes=[0, len(gltf.nodes) - 1])]
    gltf.scene = 0
    gltf.buffers = [library.Buffer(byteLength=len(blob.data))]
    gltf.set_binary_blob(bytes(blob.data))
    with replace_atomically(path) as temporary:
        gltf.save_binary(temporary)


def _joint_transforms(skin: Skin) -> Array:
    """Return T_palm_joint (16, 4, 4) at rest: the bodies' frames, the palm's moved to the wrist."""
    rest = np.linalg.inv(skin.T_body_rest)
    rest[0, :3, 3] += rest[0, :3, :3] @ skin.shape.wrist
    return np.asarray(rest)


def _nodes(library: Any, skin: Skin, rest: Array) -> list[Any]:
    """Return the tree of 16 joints, then the five fingertips."""
    lengths = HandModel(skin.shape).lengths
    nodes = [library.Node(name=name, children=[]) for name in JOINT_NAMES]
    _place(nodes[0], rest[0])
    for finger, name in enumerate(FINGERS):
        parent = 0
        for phalanx in range(3):
            body = body_of(finger, phalanx)
            _place(nodes[body], np.linalg.inv(rest[parent]) @ rest[body])
            nodes[parent].children.append(body)
            parent = body
        nodes[parent].children.append(len(nodes))
        nodes.append(library.Node(name=f"{name}_tip", translation=[0.0, float(lengths[finger, 2]), 0.0]))
    return nodes


def _place(node: Any, T_parent_node: NDArray[Any]) -> None:
    node.translation = T_parent_node[:3, 3].tolist()
    node.rotation = Rotation.from_matrix(T_parent_node[:3, :3]).as_quat().tolist()


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
