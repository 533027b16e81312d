"""Read nodes and arrays of glTF 2.0 files (.glb, .gltf), with bounds on declared sizes.

Needs the optional library pygltflib: `pip install 'depthtrack[gltf]'`.
"""

import base64
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from depthtrack.errors import InputError, MissingExtraError
from depthtrack.files import read_bounded
from depthtrack.types import Array

MAX_BYTES = 256 * 2**20
"""Largest size of a file or buffer, bytes."""
MAX_ELEMENTS = 2_000_000
"""Largest number of elements of an accessor."""
MAX_NODES = 100_000
"""Largest number of nodes."""

_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


@dataclass
class GltfDocument:
    """A glTF file: its parsed JSON `gltf`, its bytes `data`, and the buffers read so far."""

    path: Path
    gltf: Any
    data: bytes
    buffers: dict[int, bytes] = field(default_factory=dict)

    @classmethod
    def open(cls, path: Path) -> "GltfDocument":
        """Read the JSON of a file.

        Raises:
            InputError: if the file is missing or too large, has no JSON part or requires an extension.
            MissingExtraError: if pygltflib is not installed.
        """
        library = gltf_library()
        data = read_bounded(path, MAX_BYTES)
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
        if len(gltf.nodes) > MAX_NODES:
            raise InputError(f"{path} must have at most {MAX_NODES} nodes, found {len(gltf.nodes)}")
        return cls(path, gltf, data)

    def digest(self) -> str:
        """Return the SHA-256 of the file and its external buffers, 64 hexadecimal digits."""
        total = sha256(self.data)
        for index, buffer in enumerate(self.gltf.buffers):
            if buffer.uri is not None and not buffer.uri.startswith("data:"):
                total.update(self.buffer(index))
        return total.hexdigest()

    def hierarchy(self) -> tuple[Array, list[int]]:
        """Return `T_world_node` (N, 4, 4), in the file's unit, and the parents, -1 for a root.

        Raises:
            InputError: if the nodes are not a forest.
        """
        nodes = self.gltf.nodes
        above = [-1] * len(nodes)
        for n, node in enumerate(nodes):
            for child in node.children or []:
                above[child] = n
        world = np.tile(np.eye(4), (len(nodes), 1, 1))
        reached = [n for n in range(len(nodes)) if above[n] < 0]
        for n in reached:  # grows by the children of each node
            world[n] = (world[above[n]] if above[n] >= 0 else np.eye(4)) @ _local(nodes[n])
            reached.extend(child for child in nodes[n].children or [] if above[child] == n)
        if len(set(reached)) < len(nodes) or len(reached) > len(nodes):
            raise InputError(f"{self.path}: its nodes form a circle instead of a tree")
        return world, above

    def accessor(self, index: int, kind: str) -> NDArray[Any]:
        """Return the elements (count, width) of an accessor, a view of its buffer.

        Raises:
            InputError: if the accessor is not a plain `kind`, is too large, or exceeds its buffer.
        """
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
        buffer = self.buffer(view.buffer)
        needed = inside + (count - 1) * stride + width * item.itemsize
        if needed > view.byteLength or offset + view.byteLength > len(buffer):
            raise InputError(
                f"{self.path}: accessor {index} reaches beyond its buffer: the file is cut short or damaged"
            )
        return np.ndarray((count, width), item, buffer, offset + inside, (stride, item.itemsize))

    def buffer(self, index: int) -> bytes:
        """Return the bytes of a buffer, from the GLB file, a data URI or a file of the same folder.

        Raises:
            InputError: if the buffer's file is outside the folder or too large.
        """
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
                data = read_bounded(file, MAX_BYTES)
            self.buffers[index] = data
        return self.buffers[index]


def gltf_library() -> Any:
    """Import pygltflib.

    Raises:
        MissingExtraError: if it is not installed.
    """
    try:
        import pygltflib
    except ImportError as error:
        raise MissingExtraError("glTF", "gltf") from error
    return pygltflib


def _local(node: Any) -> Array:
    """Return `T_parent_node` (4, 4)."""
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
