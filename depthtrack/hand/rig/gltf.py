"""Reads rigged meshes from glTF 2.0 files (.glb, .gltf), with bounds on what a file may ask for.

Needs the optional library pygltflib: `pip install 'depthtrack[gltf]'`.
"""

import base64
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from depthtrack.errors import DepthtrackError, InputError, MissingExtraError
from depthtrack.types import Array, Index

MAX_BYTES = 256 * 2**20
"""Largest file or buffer read."""
MAX_ELEMENTS = 2_000_000
"""Most vertices, or triangle corners, a mesh may have."""
MAX_PARTS = 256
"""Most parts a mesh may come in."""
MAX_JOINTS = 1000
"""Most joints a skin may have."""

_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_TRIANGLES = 4


@dataclass(frozen=True)
class Rig:
    """A mesh and the joints that move it, in the pose it was bound in; the file's world frame, its own units.

    `names` of J joints, `parents` (J,) the nearest ancestor that is a joint, or -1; `joints` (J, 3) their places;
    `ends` the places of nodes that hang on a joint without being one, such as fingertips. `vertices` (V, 3), `faces`
    (F, 3) counter-clockwise from outside, `bound` (V, K) joints and `weights` (V, K) of each vertex, rows summing to 1.
    """

    names: tuple[str, ...]
    parents: Index
    joints: Array
    ends: dict[int, Array]
    vertices: Array
    faces: Index
    bound: Index
    weights: Array


def read_rigs(path: Path) -> Iterator[Rig]:
    """The skinned meshes of a glTF file, one Rig for each of its skins, read as they are asked for.

    Raises InputError when the file is not glTF, is damaged, holds no skinned mesh, asks for absurd sizes or for
    buffers outside its folder; MissingExtraError without pygltflib.
    """
    found = False
    try:
        document = _Document.open(path)
        for skin in range(len(document.gltf.skins)):
            if (rig := document.rig(skin)) is not None:
                found = True
                yield rig
    except DepthtrackError:
        raise
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    except Exception as error:  # whatever pygltflib or a field of the wrong type trips over
        raise InputError(f"{path} is not a readable glTF 2.0 file ({type(error).__name__}: {error})") from error
    if not found:
        raise InputError(f"{path} holds no skinned mesh: export it with its armature and skin weights")


@dataclass
class _Document:
    """One glTF file and its buffers."""

    path: Path
    gltf: Any
    buffers: dict[int, bytes]

    @classmethod
    def open(cls, path: Path) -> "_Document":
        library = gltf_library()
        data = _read_bounded(path)
        if data[:4] == b"glTF":
            gltf = library.GLTF2.load_from_bytes(data)
        else:
            gltf = library.GLTF2.gltf_from_json(data.decode("utf-8"))
        if gltf is None:
            raise InputError(f"{path} is a GLB file without its JSON part")
        if gltf.extensionsRequired:
            raise InputError(
                f"{path} requires the glTF extensions {', '.join(map(str, gltf.extensionsRequired))}, which are not "
                "supported: export it without compression"
            )
        return cls(path, gltf, {})

    def rig(self, skin: int) -> Rig | None:
        """The meshes bound to one skin, put together; None where no mesh uses it."""
        holders = [n for n in self.gltf.nodes if n.skin == skin and n.mesh is not None]
        primitives = [p for n in holders for p in self.gltf.meshes[n.mesh].primitives if p.mode in (None, _TRIANGLES)]
        if not primitives:
            return None
        joints: list[int] = self.gltf.skins[skin].joints
        T_world_node, above = self._hierarchy()
        if self.gltf.skins[skin].inverseBindMatrices is None:
            raise InputError(f"{self.path}: the skin has no inverse bind matrices: export it in its bind pose")
        inverse_bind = self._accessor(self.gltf.skins[skin].inverseBindMatrices, "MAT4").astype(np.float64)
        inverse_bind = inverse_bind.reshape(-1, 4, 4).swapaxes(1, 2)[: len(joints)]
        # What takes the mesh to the world where its first joint stands now: bones keep the pose they were bound in.
        T_world_mesh = T_world_node[joints[0]] @ inverse_bind[0]
        bind = T_world_mesh @ np.linalg.inv(inverse_bind)

        order = {node: j for j, node in enumerate(joints)}
        parents = np.full(len(joints), -1, dtype=np.int64)
        ends = {}
        for node, parent in enumerate(above):
            if node not in order and parent in order:
                j = order[parent]
                ends[j] = (bind[j] @ np.linalg.inv(T_world_node[parent]) @ T_world_node[node])[:3, 3]
            while parent >= 0 and parent not in order:
                parent = above[parent]
            if node in order and parent >= 0:
                parents[order[node]] = order[parent]

        total = sum(self.gltf.accessors[p.attributes.POSITION].count for p in primitives)
        sizes = {
            "vertices": (total, MAX_ELEMENTS),
            "parts": (len(primitives), MAX_PARTS),
            "joints": (len(joints), MAX_JOINTS),
        }
        for what, (found, most) in sizes.items():
            if found > most:
                raise InputError(f"{self.path}: a skinned mesh must have at most {most} {what}, found {found}")
        parts = [self._primitive(p, len(joints)) for p in primitives]
        starts = np.cumsum([0, *(len(part[0]) for part in parts)])
        vertices = np.concatenate([part[0] for part in parts]) @ T_world_mesh[:3, :3].T + T_world_mesh[:3, 3]
        faces = np.concatenate([part[1] + start for part, start in zip(parts, starts, strict=False)])
        if np.linalg.det(T_world_mesh[:3, :3]) < 0:
            faces = faces[:, ::-1]
        influences = max(part[2].shape[1] for part in parts)
        bound, weights = (np.concatenate([_widened(part[i], influences) for part in parts]) for i in (2, 3))
        names = tuple(str(self.gltf.nodes[node].name or f"joint{node}") for node in joints)
        rig = Rig(names, parents, bind[:, :3, 3], ends, vertices, faces, bound, weights)
        if not all(np.isfinite(array).all() for array in (rig.joints, rig.vertices, rig.weights)):
            raise InputError(f"{self.path} holds positions or weights that are not finite numbers")
        return _welded(rig)

    def _hierarchy(self) -> tuple[Array, list[int]]:
        """T_world_node (N, 4, 4) and the parent of every node, -1 for roots."""
        nodes = self.gltf.nodes
        above = [-1] * len(nodes)
        for n, node in enumerate(nodes):
            for child in node.children or []:
                above[child] = n
        world = np.tile(np.eye(4), (len(nodes), 1, 1))
        reached = [n for n in range(len(nodes)) if above[n] < 0]
        for n in reached:  # grows by the children of each node that it meets
            world[n] = (world[above[n]] if above[n] >= 0 else np.eye(4)) @ _local(nodes[n])
            reached.extend(child for child in nodes[n].children or [] if above[child] == n)
        if len(set(reached)) < len(nodes) or len(reached) > len(nodes):
            raise InputError(f"{self.path}: its nodes form a circle instead of a tree")
        return world, above

    def _primitive(self, primitive: Any, joint_count: int) -> tuple[Array, Index, Index, Array]:
        """Vertices (V, 3), faces (F, 3), joints and weights (V, K) of one part of a mesh."""
        attributes = primitive.attributes
        vertices = self._accessor(attributes.POSITION, "VEC3").astype(np.float64)
        if primitive.indices is None:
            corners = np.arange(len(vertices))
        else:
            corners = self._accessor(primitive.indices, "SCALAR").astype(np.int64)[:, 0]
        sets = [s for s in range(4) if getattr(attributes, f"JOINTS_{s}", None) is not None]
        if not sets:
            raise InputError(f"{self.path}: a mesh with a skin lacks JOINTS_0 and WEIGHTS_0")
        bound = np.concatenate([self._accessor(getattr(attributes, f"JOINTS_{s}"), "VEC4") for s in sets], axis=1)
        weights = np.concatenate([self._accessor(getattr(attributes, f"WEIGHTS_{s}"), "VEC4") for s in sets], axis=1)
        bound = bound.astype(np.int64)
        if weights.dtype.kind == "u":
            weights = weights / np.iinfo(weights.dtype).max
        weights = np.maximum(weights.astype(np.float64), 0)
        total = weights.sum(axis=1, keepdims=True)
        if len(bound) != len(vertices) or len(weights) != len(vertices) or len(corners) % 3:
            raise InputError(f"{self.path}: a mesh's attributes differ in length, or its triangles are not whole")
        if corners.max(initial=0) >= len(vertices) or bound.max(initial=0) >= joint_count or not np.all(total > 0):
            raise InputError(f"{self.path}: a mesh names vertices or joints that do not exist, or leaves some unbound")
        return vertices, corners.reshape(-1, 3), bound, weights / total

    def _accessor(self, index: int, kind: str) -> NDArray[Any]:
        """(count, width) numbers, checked to lie inside their buffer before anything is allocated."""
        accessor = self.gltf.accessors[index]
        if accessor.type != kind or accessor.sparse is not None or accessor.bufferView is None:
            raise InputError(f"{self.path}: accessor {index} must be a plain {kind}, found {accessor.type}")
        view = self.gltf.bufferViews[accessor.bufferView]
        item, width, count = np.dtype(_COMPONENTS[accessor.componentType]), _WIDTHS[kind], accessor.count
        stride = view.byteStride or width * item.itemsize
        offset, inside = (view.byteOffset or 0), (accessor.byteOffset or 0)
        numbers = (count, stride, offset, inside, view.byteLength)
        if not all(isinstance(number, int) and number >= 0 for number in numbers) or not 0 < count <= MAX_ELEMENTS:
            raise InputError(f"{self.path}: accessor {index} must hold 1 to {MAX_ELEMENTS} elements, found {count!r}")
        buffer = self._buffer(view.buffer)
        needed = inside + (count - 1) * stride + width * item.itemsize
        if needed > view.byteLength or offset + view.byteLength > len(buffer):
            raise InputError(
                f"{self.path}: accessor {index} reaches beyond its buffer: the file is cut short or damaged"
            )
        strides = (stride, item.itemsize)
        return np.ndarray((count, width), item, buffer, offset + inside, strides)

    def _buffer(self, index: int) -> bytes:
        if index not in self.buffers:
            uri = self.gltf.buffers[index].uri
            if uri is None:
                data = bytes(self.gltf.binary_blob() or b"")
            elif uri.startswith("data:"):
                data = base64.b64decode(uri.partition(",")[2], validate=True)
            else:
                folder = self.path.parent.resolve()
                file = (folder / unquote(uri)).resolve()
                if not file.is_relative_to(folder):
                    raise InputError(f"{self.path} names a buffer outside its own folder: {uri!r}")
                data = _read_bounded(file)
            self.buffers[index] = data
        return self.buffers[index]


def gltf_library() -> Any:
    try:
        import pygltflib
    except ImportError as error:
        raise MissingExtraError("glTF", "gltf") from error
    return pygltflib


def _read_bounded(path: Path) -> bytes:
    if (size := path.stat().st_size) > MAX_BYTES:
        raise InputError(f"{path} must be at most {MAX_BYTES // 2**20} MiB, found {size // 2**20} MiB")
    return path.read_bytes()


def _local(node: Any) -> Array:
    """T_parent_node (4, 4)."""
    if node.matrix is not None:
        return np.array(node.matrix, dtype=np.float64).reshape(4, 4).T
    T = np.eye(4)
    if node.rotation is not None:
        T[:3, :3] = Rotation.from_quat(node.rotation).as_matrix()
    if node.scale is not None:
        T[:3, :3] *= np.array(node.scale, dtype=np.float64)
    if node.translation is not None:
        T[:3, 3] = node.translation
    return T


def _widened(array: NDArray[Any], columns: int) -> NDArray[Any]:
    return np.pad(array, ((0, 0), (0, columns - array.shape[1])))


def _welded(rig: Rig) -> Rig:
    """Vertices at one place made one: files split them along texture seams and between parts."""
    size = float(np.ptp(rig.vertices, axis=0).max())
    places = np.round(rig.vertices / max(size * 1e-6, 1e-30)).astype(np.int64)
    _, first, index = np.unique(places, axis=0, return_index=True, return_inverse=True)
    faces = index.reshape(-1)[rig.faces]
    whole = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    return replace(
        rig,
        vertices=rig.vertices[first],
        faces=faces[whole],
        bound=rig.bound[first],
        weights=rig.weights[first],
    )
