"""Marker layouts: on the skin of any hand, both sides, and their JSON files."""

import json
from pathlib import Path

import numpy as np
import pytest
from trimesh import Trimesh
from trimesh.proximity import closest_point

from depthtrack.errors import InputError
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.implicit import rest_pose
from depthtrack.hand.skin.mesh import Skin
from depthtrack.markers.models.layout import Layout, find_layout, layout_names, load_layout

OPEN = make_pose(np.zeros(3), (1, 0, 0, 0), POSTURES["open"])
SHAPES = (
    HandShape(),
    HandShape(side="left", scale=0.8),
    HandShape(lengths=HandShape().lengths * 1.1, radii=HandShape().radii * 0.9, palm_breadth=0.085),
)


def one_marker(**changes: object) -> dict[str, object]:
    row = {"label": "a", "bone": "index_distal", "along": 0.5, "around_deg": 0} | changes
    return {"about": "", "radius_mm": 2, "spread_mm": 3, "markers": [row]}


def test_included_layouts_have_their_number_of_markers() -> None:
    assert layout_names() == ("13", "16", "16-nokov", "19", "19-nokov", "26")
    for name in layout_names():
        assert len(load_layout(name, HandShape()).labels) == int(name[:2])


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("name", ["13", "19", "26"])
def test_markers_are_one_radius_off_the_skin(name: str, shape: HandShape) -> None:
    model, skin = load_layout(name, shape), Skin.of(shape)
    pose = rest_pose(shape)
    points = model.positions(pose)
    mesh = Trimesh(skin.vertices(HandModel(shape).transforms(pose)), skin.faces, process=False)
    distance = np.asarray(closest_point(mesh, points)[1])  # type: ignore[no-untyped-call]
    radius = find_layout(name).radius
    # The solid's distance is exact near fingers; rounded edges at the wrist are further than it states.
    assert np.all(distance > radius - 0.0005)
    assert np.all(distance < radius + 0.0016)


@pytest.mark.parametrize("name", ["13", "16", "19", "26"])
def test_markers_are_on_the_back_of_the_hand(name: str) -> None:
    model = load_layout(name, HandShape())
    points = model.positions(OPEN)
    joints = HandModel(HandShape()).joints(OPEN)
    on_fingers = model.bodies > 3
    assert np.all(points[on_fingers, 2] < joints[model.bodies[on_fingers], 2])
    assert np.all(points[model.bodies == 0, 2] < 0.01)


def test_a_left_hand_mirrors_a_right_one() -> None:
    right, left = (load_layout("26", HandShape(side=side)) for side in ("right", "left"))
    np.testing.assert_allclose(left.offsets, right.offsets * [-1, 1, 1], atol=1e-12)
    assert (left.name, right.name) == ("left", "right")


def test_offsets_scale_with_the_hand() -> None:
    small, large = (Layout.from_fields(one_marker() | {"radius_mm": 0}).on(HandShape(scale=s)) for s in (0.8, 1.2))
    np.testing.assert_allclose(large.offsets, small.offsets * 1.5, rtol=1e-6)


def test_a_marker_moves_around_its_bone() -> None:
    back, side, pad = (
        Layout.from_fields(one_marker(around_deg=angle)).on(HandShape()).offsets[0] for angle in (0, 90, 180)
    )
    assert back[2] < -0.005
    assert side[0] > 0.005
    assert pad[2] > 0.005
    assert back[1] == pytest.approx(side[1])


def test_a_user_layout_renames_and_drops_markers(tmp_path: Path) -> None:
    path = tmp_path / "mine.json"
    path.write_text(json.dumps({"like": "26", "labels": {"F1": "index_distal", "H": "index_knuckle"}}))
    model, whole = load_layout(str(path), HandShape()), load_layout("26", HandShape())
    assert model.labels == ("F1", "H")
    np.testing.assert_array_equal(
        model.offsets, whole.offsets[[whole.labels.index(x) for x in ("index_distal", "index_knuckle")]]
    )


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        (one_marker(bone="toe"), "the bone must be one of"),
        (one_marker(along=1.5), "along must lie between 0 and 1"),
        (one_marker(around_deg=200), "within 180 degrees"),
        (one_marker(along=float("1e300")), "along"),
        (one_marker(label=None) | {"radius_mm": 200}, "at most 20 mm"),
        ({"like": "27", "labels": {}}, "unknown marker layout '27'"),
        ({"like": "26", "labels": {"a": "b"}}, "unknown label 'b'"),
        ({"like": "26"}, "'labels' is missing"),
        ({"markers": []}, "is missing"),
        ([], "cannot read the marker layout"),
        ({"like": "26", "labels": {}}, "1 to 256 markers, found 0"),
    ],
)
def test_faulty_layouts_are_rejected(tmp_path: Path, fields: object, message: str) -> None:
    path = tmp_path / "layout.json"
    path.write_text(json.dumps(fields))
    with pytest.raises(InputError, match=message):
        load_layout(str(path), HandShape())


def test_a_missing_layout_is_rejected(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="unknown marker layout 'twelve': use 13, 16"):
        load_layout("twelve", HandShape())
    with pytest.raises(InputError, match="missing"):
        load_layout(str(tmp_path / "none.json"), HandShape())
