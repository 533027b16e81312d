"""A held object lies in the palm, stops the fingers and moves with the palm."""

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import ANGLES, make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.shape import HandShape, Side
from depthtrack.synthesis.generate import Synthesis, Synthesiser
from depthtrack.synthesis.held_object import HeldKind, HeldObject

KINDS: tuple[HeldKind, ...] = ("sphere", "box", "cylinder")


def object_in(hand: HandShape, kind: HeldKind, size: float = 0.06) -> HeldObject:
    return HeldObject.sample(kind, size, hand, np.random.default_rng(3))


@pytest.mark.parametrize("kind", KINDS)
def test_distances_are_those_of_the_mesh(kind: HeldKind) -> None:
    held = object_in(HandShape(), kind)
    corners, normals = held._mesh
    np.testing.assert_allclose(held.distance(corners), 0, atol=1e-9)
    middles, across = corners.reshape(-1, 3, 3).mean(axis=1), normals[::3]
    # Facets of a sphere and a cylinder lie up to 0.1 mm inside.
    np.testing.assert_allclose(held.distance(middles + 0.004 * across), 0.004, atol=1e-4)
    np.testing.assert_allclose(held.distance(middles - 0.004 * across), -0.004, atol=1e-4)


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("kind", KINDS)
def test_fingers_stop_at_the_object(kind: HeldKind, side: Side) -> None:
    hand = HandShape().with_(side=side, scale=1.1)
    held, model = object_in(hand, kind), HandModel(hand)
    poses = make_pose(np.zeros(3), (1, 0, 0, 0), np.stack(list(POSTURES.values())))
    opened = held.opened(poses, hand)
    tips = model.endpoints(opened).reshape(-1, 5, 4, 3)[:, 1:]
    assert held.distance(tips[:, :, 2:]).min() > 0
    fist = list(POSTURES).index("fist")
    assert held.distance(model.endpoints(poses[fist])).min() < -0.01
    np.testing.assert_array_equal(opened[0], poses[0])  # the open hand holds it already
    assert np.all(np.abs(opened[:, ANGLES]) <= np.abs(poses[:, ANGLES]) + np.abs(POSTURES["open"]))


@pytest.mark.parametrize("kind", KINDS)
def test_a_recording_shows_the_object_which_is_no_skin(kind: HeldKind) -> None:
    made = Synthesiser(Synthesis("everyday", frames=2, held_object=kind, model="skin"))
    frame = made[1]
    covered = (frame.exact_depth > 0) & ~frame.mask
    assert np.count_nonzero(covered) > 500
    assert not frame.skin[covered].any()
    assert made.description()["held_object"] == kind


def test_the_object_moves_with_the_palm() -> None:
    made = Synthesiser(Synthesis("everyday", frames=6, rate=1, held_object="sphere"))
    assert made.held is not None
    T = HandModel(HandShape()).transforms(made.poses)[:, 0]
    centres = np.einsum("nij,j->ni", T[:, :3, :3], made.held.centre) + T[:, :3, 3]
    for centre, frame in zip(centres, made.frames(1), strict=True):
        u, v = np.rint(made.sensor.camera.project(centre)).astype(int)
        ray = centre / np.linalg.norm(centre)
        assert frame.exact_depth[v, u] <= (centre - ray * 0.0299)[2] + 1e-3


def test_a_recording_without_an_object_is_as_before() -> None:
    plain, other = (Synthesiser(Synthesis("grasp", frames=2, held_size=size)) for size in (0.06, 0.03))
    np.testing.assert_array_equal(plain[1].colour, other[1].colour)
    np.testing.assert_array_equal(plain[1].depth, other[1].depth)
    assert plain.held is None


@pytest.mark.parametrize("change", [{"held_object": "cup"}, {"held_size": 0.5}, {"held_size": float("nan")}])
def test_impossible_objects_are_rejected(change: dict[str, object]) -> None:
    with pytest.raises(InputError, match="held"):
        Synthesis("grasp", **change)  # type: ignore[arg-type]
