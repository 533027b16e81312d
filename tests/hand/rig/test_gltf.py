"""glTF files: buffers, bind poses, and one sentence for each unusable file."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from depthtrack.errors import InputError
from depthtrack.hand.kinematics import JOINT_NAMES
from depthtrack.hand.rig.gltf import read_rigs
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.mesh import Skin
from tests.support.rigs import distances, load_skin, parts, write_gltf, write_rig

DEFAULT = HandShape()


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


@pytest.mark.parametrize("given", [True, False])
def test_without_inverse_bind_matrices_the_nodes_define_the_mesh(own_glb: Path, tmp_path: Path, given: bool) -> None:
    """The standard's default is the identity: vertices are in the frames of their joints."""
    rig = next(read_rigs(own_glb))
    strongest = rig.bound[np.arange(len(rig.bound)), rig.weights.argmax(axis=1)]
    names = list(rig.names)
    path = write_rig(
        tmp_path / "local.glb",
        rig.vertices - rig.joints[strongest],
        rig.faces,
        np.eye(len(names))[strongest],
        names,
        rig.parents,
        rig.joints,
        inverse_bind=np.tile(np.eye(4), (len(names), 1, 1)) if given else None,
    )
    found = load_skin(path, "right")
    assert distances(found.rest, load_skin(own_glb).rest).max() < 1e-6
    np.testing.assert_allclose(found.shape.lengths, load_skin(own_glb).shape.lengths, atol=2e-4)


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
    ],
)
def test_unusable_files_get_one_sentence(own_glb: Path, tmp_path: Path, spoil: Any, message: str) -> None:
    document, binary = parts(own_glb)
    spoil(document)
    path = write_gltf(tmp_path / "spoilt.gltf", document, binary)
    with pytest.raises(InputError, match=message) as caught:
        load_skin(path)
    assert str(path) in str(caught.value)


def test_buffers_outside_the_folder_are_rejected(own_glb: Path, tmp_path: Path) -> None:
    document, binary = parts(own_glb)
    (tmp_path / "outside.bin").write_bytes(binary)
    (tmp_path / "rig").mkdir()
    for uri in ("../outside.bin", str(tmp_path / "outside.bin"), "..%2Foutside.bin"):
        with pytest.raises(InputError, match="outside its own folder"):
            load_skin(write_gltf(tmp_path / "rig" / "hand.gltf", document, binary, uri))
    with pytest.raises(InputError, match="missing or no regular file"):
        load_skin(tmp_path / "absent.glb")


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_damaged_file_is_read_or_rejected_in_a_sentence(own_glb: Path, tmp_path: Path, data: st.DataObject) -> None:
    """The damage truncates the file, or replaces a number or name of its JSON."""
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
