"""The skinned mesh is closed, has the hand's sizes, and keeps its shape in extreme postures."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from depthtrack.errors import InputError
from depthtrack.hand.kinematics import HandModel, body_of
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.pose import make_pose
from depthtrack.hand.primitives import SPHERE, Primitives
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.implicit import rest_pose
from depthtrack.hand.skin.mesh import Skin
from depthtrack.types import Array

DEFAULT = HandShape()
FIST = np.radians([(12, 22, 45, 45), (4, 80, 100, 60), (0, 85, 100, 60), (-4, 85, 100, 60), (-8, 85, 100, 60)])
OPPOSED = np.radians([(-18, 25, 45, 40), (0, 15, 20, 10), (0, 15, 20, 10), (-5, 25, 30, 20), (-12, 65, 60, 40)])
HOOK = np.radians([(10, 0, 0, 0), (4, 0, 108, 75), (0, 0, 108, 75), (-4, 0, 108, 75), (-10, 0, 108, 75)])
SPLAYED = np.radians([(15, -15, -5, -5), (20, 0, 0, 0), (0, 0, 0, 0), (-17, 0, 0, 0), (-28, 0, 0, 0)])
EXTREMES = {"fist": FIST, "opposed": OPPOSED, "hook": HOOK, "splayed": SPLAYED, "lower": LOWER, "upper": UPPER}


def posed(angles: Array) -> Array:
    return make_pose(np.zeros(3), (1, 0, 0, 0), np.ravel(angles))


def varied(seed: int, side: str = "right") -> HandShape:
    """Return sizes that differ from the default slightly more than people's do."""
    rng = np.random.default_rng(seed)
    return DEFAULT.with_(
        side=side,
        scale=rng.uniform(0.5, 1.5),
        lengths=DEFAULT.lengths * rng.uniform(0.8, 1.25, (5, 3)),
        radii=DEFAULT.radii * rng.uniform(0.75, 1.25),
        bases=DEFAULT.bases * rng.uniform(0.9, 1.15, 3),
        **{
            name: getattr(DEFAULT, name) * rng.uniform(0.85, 1.2)
            for name in ("palm_breadth", "palm_length", "palm_thickness", "wrist_breadth", "wrist_thickness")
        },
    )


@settings(max_examples=5, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), side=st.sampled_from(["right", "left"]))
def test_the_mesh_is_closed_and_has_the_sizes_of_the_hand(seed: int, side: str) -> None:
    shape = varied(seed, side)
    skin = Skin.of(shape)
    mesh = skin.to_trimesh(skin.rest)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume > 0  # faces look outward
    assert (mesh.euler_number, mesh.body_count) == (2, 1)
    assert mesh.area_faces.min() > 1e-9 * shape.scale**2
    assert 4000 < len(skin.rest) < 10000
    tips = HandModel(shape).endpoints(rest_pose(shape))[3::4]
    gaps = np.abs(mesh.nearest.on_surface(tips)[1])
    assert gaps.max() < 0.7e-3 * shape.scale
    assert skin.rest[:, 1].min() <= shape.wrist[1] + 1e-3


def test_weights_are_convex_and_stay_on_their_finger() -> None:
    skin = Skin.of(DEFAULT)
    assert skin.weights.min() >= 0
    np.testing.assert_allclose(skin.weights.sum(axis=-1), 1, rtol=0, atol=1e-12)
    by_finger = skin.weights[:, 1:].reshape(-1, 5, 3).sum(axis=-1)
    # A web follows its two adjacent fingers only, and a tip follows one finger.
    for finger in range(5):
        for other in range(finger + 2, 5):
            assert np.minimum(by_finger[:, finger], by_finger[:, other]).max() < 0.02
        tip = HandModel(DEFAULT).endpoints(rest_pose(DEFAULT))[4 * finger + 3]
        nearest = np.argmin(np.linalg.norm(skin.rest - tip, axis=-1))
        assert skin.weights[nearest, body_of(finger, 2)] == 1
        assert set(skin.face_bodies) == set(range(16))
    assert skin.weights[np.argmin(skin.rest[:, 1]), 0] == 1


def test_the_rest_pose_gives_the_rest_mesh() -> None:
    skin = Skin.of(DEFAULT)
    np.testing.assert_allclose(skin.at(rest_pose(DEFAULT)), skin.rest, rtol=0, atol=1e-12)


def test_blending_agrees_with_the_plain_sum() -> None:
    skin, model = Skin.of(DEFAULT), HandModel(DEFAULT)
    poses = np.stack([posed(FIST), posed(HOOK)])
    poses[0, :7] = [0.1, -0.2, 0.5, 0.3, 0.5, -0.2, 0.8]
    transforms = model.transforms(poses)
    vertices = skin.vertices(transforms)
    for pose in range(2):
        for v in range(0, len(skin.rest), 997):
            expected = np.zeros(4)
            for body in range(16):
                expected += skin.weights[v, body] * (
                    transforms[pose, body] @ skin.T_body_rest[body] @ np.append(skin.rest[v], 1)
                )
            np.testing.assert_allclose(vertices[pose, v], expected[:3], rtol=0, atol=1e-12)


def test_normals_point_outward() -> None:
    skin = Skin.of(DEFAULT)
    vertices = skin.at(np.stack([posed(np.zeros(20)), posed(SPLAYED)]))
    normals = skin.normals(vertices)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=-1), 1, rtol=0, atol=1e-9)
    for mesh_vertices, mesh_normals in zip(vertices, normals, strict=True):
        expected = skin.to_trimesh(mesh_vertices).vertex_normals
        assert np.quantile(np.sum(expected * mesh_normals, axis=-1), 0.001) > 0.9


def test_left_hand_mirrors_the_right() -> None:
    right, left = Skin.of(DEFAULT), Skin.of(DEFAULT.with_(side="left"))
    np.testing.assert_array_equal(left.weights, right.weights)
    mirrored = right.at(posed(OPPOSED)) * np.array([-1, 1, 1])
    np.testing.assert_allclose(left.at(posed(OPPOSED)), mirrored, rtol=0, atol=1e-12)
    assert left.to_trimesh(left.rest).volume == pytest.approx(right.to_trimesh(right.rest).volume)


@pytest.mark.parametrize(
    ("changes", "body", "direction", "where"),
    [
        ({"lengths": DEFAULT.lengths + 0.004 * np.eye(5, 3, -1)}, body_of(1, 1), (0, 1, 0), (0.05, 0.2)),
        ({"radii": DEFAULT.radii + 0.002}, body_of(2, 1), (1, 0, 0), (0.05, 0.2)),
        ({"bases": DEFAULT.bases + np.array([0, 0.005, 0])}, body_of(3, 2), (0, 1, 0), (0.05, 0.2)),
        ({"palm_breadth": DEFAULT.palm_breadth + 0.01}, 0, (-1, 0, 0), (0.0, 0.04)),
        ({"palm_thickness": DEFAULT.palm_thickness + 0.01}, 0, (0, 0, -1), (0.0, 0.02)),
        ({"palm_length": DEFAULT.palm_length + 0.01}, 0, (0, -1, 0), (-0.1, 0.0)),
        ({"wrist_breadth": DEFAULT.wrist_breadth + 0.01}, 0, (-1, 0, 0), (-0.045, -0.035)),
        ({"wrist_thickness": DEFAULT.wrist_thickness + 0.01}, 0, (0, 0, -1), (-0.045, -0.035)),
        ({"thumb_direction": np.array([0.4, 0.73, 0.36])}, body_of(0, 2), (-1, 0, 0), (-0.1, 0.2)),
        ({"scale": 1.1}, body_of(4, 2), (0, 1, 0), (0.05, 0.2)),
    ],
)
def test_every_size_changes_the_mesh(
    changes: dict[str, object], body: int, direction: tuple[int, int, int], where: tuple[float, float]
) -> None:
    """The skin moves by a millimetre in the direction of the size, at heights y of `where`."""

    def reach(skin: Skin) -> float:
        vertices = skin.at(posed(np.zeros(20)))
        own = (skin.weights.argmax(axis=-1) == body) & (vertices[:, 1] > where[0]) & (vertices[:, 1] < where[1])
        return float((vertices[own] @ np.array(direction)).max())

    assert reach(Skin.of(DEFAULT.with_(**changes))) > reach(Skin.of(DEFAULT)) + 1e-3


@pytest.mark.parametrize("name", EXTREMES)
def test_extreme_postures_keep_the_volume(name: str) -> None:
    skin, model = Skin.of(DEFAULT), HandModel(DEFAULT)
    transforms = model.transforms(posed(EXTREMES[name]))
    vertices = skin.vertices(transforms)
    volume = skin.to_trimesh(vertices).volume / skin.to_trimesh(skin.rest).volume
    assert 0.94 < volume < 1.06
    # A face is inverted if its normal opposes its blended rotation, which only folds at creases may do.
    carried = np.einsum(
        "fb,bij->fij", skin.weights[skin.faces].mean(axis=1), (transforms @ skin.T_body_rest)[:, :3, :3]
    )
    before, after = (np.cross(*_edges(skin, v)) for v in (skin.rest, vertices))
    agreement = np.einsum("fi,fij,fj->f", after, carried, before)
    assert np.mean(agreement <= 0) < 0.012
    stretch = np.linalg.norm(after, axis=-1) / np.linalg.norm(before, axis=-1)
    assert np.mean(stretch < 0.05) < 0.001
    assert stretch.max() < 4


def _edges(skin: Skin, vertices: Array) -> tuple[Array, Array]:
    a, b, c = (vertices[skin.faces[:, k]] for k in range(3))
    return b - a, c - a


def test_bent_joints_keep_their_thickness() -> None:
    """In a fist the skin stays 0.8 radii or more from the middle joints (no candy wrapper)."""
    skin, model = Skin.of(DEFAULT), HandModel(DEFAULT)
    vertices, joints = skin.at(posed(FIST)), model.joints(posed(FIST))
    for finger in range(1, 5):
        gap = np.linalg.norm(vertices - joints[body_of(finger, 1)], axis=-1).min()
        assert gap > 0.8 * DEFAULT.radii[finger, 1]


@pytest.mark.parametrize(("angles", "mean_mm", "p95_mm"), [(SPLAYED, 0.95, 3.0), (FIST, 0.9, 2.6)])
def test_skin_and_primitives_agree(angles: Array, mean_mm: float, p95_mm: float) -> None:
    """The primitives lie close to the skin."""
    skin, model, primitives = Skin.of(DEFAULT), HandModel(DEFAULT), Primitives.of(DEFAULT)
    transforms = model.transforms(posed(angles))
    surface = _visible_surface(primitives, primitives.transforms(transforms))
    vertices = skin.vertices(transforms)
    points = np.concatenate([vertices, vertices[skin.faces].mean(axis=1)])
    distance = np.asarray(cKDTree(points).query(surface)[0]) * 1000
    assert distance.mean() < mean_mm
    assert np.quantile(distance, 0.95) < p95_mm


def test_the_caps_close_the_palm_of_the_primitives() -> None:
    """The rims of the cylinder, which has no ends of its own, lie in the ellipsoids."""
    cylinder, *caps = Primitives.of(DEFAULT).T_body_unit[:3]
    angle = np.linspace(0, 2 * np.pi, 60)
    for cap, end in zip(caps, (0.0, 1.0), strict=True):
        rim = np.column_stack([np.cos(angle), np.sin(angle), np.full(60, end), np.ones(60)]) @ cylinder.T
        inside = np.linalg.norm((rim @ np.linalg.inv(cap).T)[:, :3], axis=1)
        assert inside.max() < 1.02


def _visible_surface(primitives: Primitives, T_palm_unit: Array) -> Array:
    """Return points of the primitives' surfaces that lie outside all other primitives."""
    rng = np.random.default_rng(0)
    points, owners = [], []
    for n, (kind, T) in enumerate(zip(primitives.kinds, T_palm_unit, strict=True)):
        unit = rng.normal(size=(400, 3))
        unit /= np.linalg.norm(unit, axis=-1, keepdims=True)
        if kind != SPHERE:
            turn = rng.uniform(0, 2 * np.pi, 400)
            unit = np.stack([np.cos(turn), np.sin(turn), rng.uniform(0, 1, 400)], axis=-1)
        p = np.c_[unit, np.ones(400)] @ T.T
        points.append(p[:, :3] / p[:, 3:])
        owners.append(np.full(400, n))
    surface, owner = np.concatenate(points), np.concatenate(owners)
    free = np.ones(len(surface), dtype=bool)
    for n, (kind, T) in enumerate(zip(primitives.kinds, T_palm_unit, strict=True)):
        u = np.c_[surface, np.ones(len(surface))] @ np.linalg.inv(T).T
        u = u[:, :3] / u[:, 3:]
        inside = np.sum(u[:, : 3 if kind == SPHERE else 2] ** 2, axis=-1) < 0.999
        if kind != SPHERE:
            inside &= (u[:, 2] > 0) & (u[:, 2] < 1)
        free &= ~(inside & (owner != n))
    return np.asarray(surface[free])


def test_sizes_without_a_closed_skin_are_rejected() -> None:
    with pytest.raises(InputError, match="five free fingers"):
        Skin.of(DEFAULT.with_(radii=DEFAULT.radii * 0.02))


def test_skins_are_made_once() -> None:
    assert Skin.of(HandShape()) is Skin.of(HandShape())
    with pytest.raises(ValueError, match="read-only"):
        Skin.of(DEFAULT).rest[0] = 0
