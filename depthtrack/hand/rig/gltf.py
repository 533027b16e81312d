"""Read skinned meshes and their joints from glTF 2.0 files."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthtrack.errors import DepthtrackError, InputError
from depthtrack.hand.rig.gltf_document import MAX_ELEMENTS, GltfDocument
from depthtrack.types import Array, Index

MAX_PARTS = 256
"""Largest number of primitives of a mesh."""
MAX_JOINTS = 1000
"""Largest number of joints of a skin."""

_TRIANGLES = 4


@dataclass(frozen=True)
class Rig:
    """A skinned mesh and its J joints in the bind pose, in the file's world frame and unit.

    `names`: of the joints.
    `parents` (J,): nearest ancestor that is a joint, or -1.
    `joints` (J, 3): positions of the joints.
    `ends`: position (3,) of a node below a joint that is no joint itself, such as a fingertip, by joint.
    `vertices` (V, 3), `faces` (F, 3): counter-clockwise from outside.
    `bound` (V, K), `weights` (V, K): joints of each vertex and their weights; rows sum to 1.
    """

    names: tuple[str, ...]
    parents: Index
    joints: Array
    ends: dict[int, Array]
    vertices: Array
    faces: Index
    bound: Index
    weights: Array


@dataclass(frozen=True)
class _Part:
    """One primitive of a mesh, in the mesh's frame: see `Rig`."""

    vertices: Array
    faces: Index
    bound: Index
    weights: Array


def read_rigs(path: Path) -> Iterator[Rig]:
    """Yield the skinned meshes of a glTF file, one for each of its skins.

    Raises:
        InputError: if the file is not glTF, is damaged, has no skinned mesh, or exceeds a bound on sizes.
        MissingExtraError: if pygltflib is not installed.
    """
    found = False
    with _one_sentence(path):
        document = GltfDocument.open(path)
        for skin in range(len(document.gltf.skins)):
            if (rig := _rig(document, skin)) is not None:
                found = True
                yield rig
    if not found:
        raise InputError(f"{path} holds no skinned mesh: export it with its armature and skin weights")


def gltf_digest(path: Path) -> str:
    """Return the SHA-256 of a glTF file and its external buffers, 64 hexadecimal digits.

    Raises:
        InputError: if the file cannot be read or is not glTF.
        MissingExtraError: if pygltflib is not installed.
    """
    with _one_sentence(path):
        return GltfDocument.open(path).digest()


@contextmanager
def _one_sentence(path: Path) -> Iterator[None]:
    """Turn every error of reading a file into an InputError."""
    try:
        yield
    except DepthtrackError:
        raise
    except Exception as error:  # pygltflib, or a field of another type, raises all kinds
        raise InputError(f"{path} is not a readable glTF 2.0 file ({type(error).__name__}: {error})") from error


def _rig(document: GltfDocument, skin: int) -> Rig | None:
    """Return the meshes bound to one skin as one mesh; None if no mesh uses the skin."""
    gltf = document.gltf
    holders = [n for n in gltf.nodes if n.skin == skin and n.mesh is not None]
    primitives = [p for n in holders for p in gltf.meshes[n.mesh].primitives if p.mode in (None, _TRIANGLES)]
    if not primitives:
        return None
    nodes: list[int] = gltf.skins[skin].joints
    vertex_count = sum(gltf.accessors[p.attributes.POSITION].count for p in primitives)
    _check_sizes(document.path, vertices=vertex_count, parts=len(primitives), joints=len(nodes))
    T_world_node, above = document.hierarchy()
    part = _joined([_read_part(document, primitive, len(nodes)) for primitive in primitives])
    inverse_bind = _inverse_bind(document, skin, len(nodes))
    if np.ptp(inverse_bind, axis=0).max() == 0:
        # Applied in advance, as the standard's default, the identity: only the pose of the nodes places the mesh.
        bind = T_world_node[nodes] @ inverse_bind
        T_world_vertex = np.einsum("vk,vkij->vij", part.weights, bind[part.bound])
        vertices = np.einsum("vij,vj->vi", T_world_vertex[:, :3, :3], part.vertices) + T_world_vertex[:, :3, 3]
    else:
        # From the mesh to the world at the first joint's present place: bones keep the pose they were bound in.
        T_world_mesh = T_world_node[nodes[0]] @ inverse_bind[0]
        bind = T_world_mesh @ np.linalg.inv(inverse_bind)
        vertices = part.vertices @ T_world_mesh[:3, :3].T + T_world_mesh[:3, 3]
    flipped = float(np.linalg.det((T_world_node[nodes[0]] @ inverse_bind[0])[:3, :3])) < 0
    parents, ends = _tree(nodes, above, bind, T_world_node)
    names = tuple(str(gltf.nodes[node].name or f"joint{node}") for node in nodes)
    faces = part.faces[:, ::-1] if flipped else part.faces
    rig = Rig(names, parents, bind[:, :3, 3], ends, vertices, faces, part.bound, part.weights)
    if not all(np.isfinite(array).all() for array in (rig.joints, rig.vertices, rig.weights)):
        raise InputError(f"{document.path} holds positions or weights that are not finite numbers")
    return _welded(rig)


def _inverse_bind(document: GltfDocument, skin: int, count: int) -> Array:
    """Return `T_joint_mesh` (J, 4, 4) of the bind pose; identities if the skin has none."""
    index = document.gltf.skins[skin].inverseBindMatrices
    if index is None:
        return np.tile(np.eye(4), (count, 1, 1))
    columns = document.accessor(index, "MAT4").astype(np.float64)
    if len(columns) < count:
        raise InputError(f"{document.path}: its skin must have {count} inverse bind matrices, found {len(columns)}")
    return columns.reshape(-1, 4, 4).swapaxes(1, 2)[:count]


def _check_sizes(path: Path, vertices: int, parts: int, joints: int) -> None:
    sizes = {
        "vertices": (vertices, MAX_ELEMENTS),
        "parts": (parts, MAX_PARTS),
        "joints": (joints, MAX_JOINTS),
    }
    for what, (found, most) in sizes.items():
        if found > most:
            raise InputError(f"{path}: a skinned mesh must have at most {most} {what}, found {found}")


def _tree(nodes: list[int], above: list[int], bind: Array, T_world_node: Array) -> tuple[Index, dict[int, Array]]:
    """Return the parents (J,) of the joints and the ends below them: see `Rig`."""
    order = {node: j for j, node in enumerate(nodes)}
    parents = np.full(len(nodes), -1, dtype=np.int64)
    ends = {}
    for node, parent in enumerate(above):
        if node not in order and parent in order:
            j = order[parent]
            ends[j] = (bind[j] @ np.linalg.inv(T_world_node[parent]) @ T_world_node[node])[:3, 3]
        while parent >= 0 and parent not in order:
            parent = above[parent]
        if node in order and parent >= 0:
            parents[order[node]] = order[parent]
    return parents, ends


def _read_part(document: GltfDocument, primitive: Any, joint_count: int) -> _Part:
    attributes, path = primitive.attributes, document.path
    vertices = document.accessor(attributes.POSITION, "VEC3").astype(np.float64)
    if primitive.indices is None:
        corners = np.arange(len(vertices))
    else:
        corners = document.accessor(primitive.indices, "SCALAR").astype(np.int64)[:, 0]
    sets = [s for s in range(4) if getattr(attributes, f"JOINTS_{s}", None) is not None]
    if not sets:
        raise InputError(f"{path}: a mesh with a skin lacks JOINTS_0 and WEIGHTS_0")
    bound = np.concatenate([document.accessor(getattr(attributes, f"JOINTS_{s}"), "VEC4") for s in sets], axis=1)
    weights = np.concatenate([document.accessor(getattr(attributes, f"WEIGHTS_{s}"), "VEC4") for s in sets], axis=1)
    bound = bound.astype(np.int64)
    if weights.dtype.kind == "u":
        weights = weights / np.iinfo(weights.dtype).max
    weights = np.maximum(weights.astype(np.float64), 0)
    total = weights.sum(axis=1, keepdims=True)
    if len(bound) != len(vertices) or len(weights) != len(vertices) or len(corners) % 3:
        raise InputError(f"{path}: a mesh's attributes differ in length, or its triangles are not whole")
    if corners.max(initial=0) >= len(vertices) or bound.max(initial=0) >= joint_count or not np.all(total > 0):
        raise InputError(f"{path}: a mesh names vertices or joints that do not exist, or leaves some unbound")
    return _Part(vertices, corners.reshape(-1, 3), bound, weights / total)


def _joined(parts: list[_Part]) -> _Part:
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    influences = max(part.bound.shape[1] for part in parts)
    return _Part(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=False)]),
        np.concatenate([_widened(part.bound, influences) for part in parts]),
        np.concatenate([_widened(part.weights, influences) for part in parts]),
    )


def _widened(array: NDArray[Any], columns: int) -> NDArray[Any]:
    return np.pad(array, ((0, 0), (0, columns - array.shape[1])))


def _welded(rig: Rig) -> Rig:
    """Merge vertices at one place: files split them along texture seams and between parts."""
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
