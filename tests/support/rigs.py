"""Rigged hands in glTF files, made in code."""

import base64
import json
import struct
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from depthtrack.hand.hand_file import load_hand
from depthtrack.hand.shape import Side
from depthtrack.hand.skin.mesh import Skin
from depthtrack.types import Array


def distances(cloud: Array, points: Array) -> Array:
    """Return the distances (N,) from points (N, 3) to the nearest point of a cloud (M, 3)."""
    return np.asarray(cKDTree(cloud).query(points)[0])


def load_skin(path: Path, side: Side | None = None) -> Skin:
    """Return the skin of the rigged hand in a file."""
    return Skin.of(load_hand(path, side))


def parts(path: Path) -> tuple[dict[str, Any], bytes]:
    """Return the JSON and the binary part of a GLB file."""
    data = path.read_bytes()
    length = struct.unpack("<I", data[12:16])[0]
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def write_gltf(path: Path, document: dict[str, Any], binary: bytes, uri: str | None = None) -> Path:
    """Write a glTF text file, its buffer inline or at `uri`."""
    inline = "data:application/octet-stream;base64," + base64.b64encode(binary).decode()
    document["buffers"][0] = {"byteLength": len(binary), "uri": uri or inline}
    path.write_text(json.dumps(document))
    return path


def write_rig(
    path: Path,
    vertices: Array,
    faces: NDArray[np.int64],
    weights: Array,
    names: list[str],
    parents: NDArray[np.int64],
    heads: Array,
    inverse_bind: Array | Literal["heads"] | None = "heads",
) -> Path:
    """Write a GLB of another make: unrotated joints, eight influences, bytes and shorts."""
    strongest = np.argsort(-weights, axis=1, kind="stable")[:, :8]
    share = np.take_along_axis(weights, strongest, axis=1)
    matrices = np.tile(np.eye(4), (len(names), 1, 1))
    if isinstance(inverse_bind, str):
        matrices[:, 3, :3] = -heads  # column by column
    arrays = {
        "POSITION": (vertices.astype("<f4"), "VEC3", 5126),
        "JOINTS_0": (strongest[:, :4].astype("<u1"), "VEC4", 5121),
        "JOINTS_1": (strongest[:, 4:].astype("<u1"), "VEC4", 5121),
        "WEIGHTS_0": (np.round(share[:, :4] * 65535).astype("<u2"), "VEC4", 5123),
        "WEIGHTS_1": (np.round(share[:, 4:] * 65535).astype("<u2"), "VEC4", 5123),
        "indices": (faces.astype("<u4").reshape(-1, 1), "SCALAR", 5125),
        "inverse_bind": (matrices.reshape(-1, 16).astype("<f4"), "MAT4", 5126),
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
        "skins": [{"joints": list(range(len(names)))} | ({} if inverse_bind is None else {"inverseBindMatrices": 6})],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    header = b"glTF" + struct.pack("<II", 2, 28 + len(text) + len(blob))
    path.write_bytes(
        header + struct.pack("<I", len(text)) + b"JSON" + text + struct.pack("<I", len(blob)) + b"BIN\0" + blob
    )
    return path


def write_makehuman_rig(path: Path, data: Path, letter: str) -> Path:
    """Write the MakeHuman hand ("R" or "L") of the real data as a GLB in decimetres."""
    with np.load(data / "meshes" / "makehuman-hand" / f"hand_{letter}.npz") as hand:
        names = [str(name) for name in hand["bones"]]
        return write_rig(
            path, hand["vertices_dm"], hand["triangles"], hand["weights"], names, hand["parent"], hand["head"]
        )
