"""The displacement of the skin: its nodes, its vertices, and its entry in hand files."""

from typing import get_args

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.hand.displacement_grid import NODES, neighbour_differences
from depthtrack.hand.shape import HandShape, Side
from depthtrack.hand.skin.displacement import displacement_basis
from depthtrack.hand.skin.mesh import Skin
from depthtrack.types import Array


def _drawn(seed: int = 4, spread: float = 0.001) -> Array:
    return np.clip(spread * np.random.default_rng(seed).standard_normal(NODES), -0.01, 0.01)


def test_shares_of_each_vertex_sum_to_one() -> None:
    skin = Skin.of(HandShape())
    basis = displacement_basis(HandShape(), skin.rest, skin.weights, skin.T_body_rest).toarray()
    assert basis.min() >= 0
    np.testing.assert_allclose(basis.sum(axis=1), 1, atol=1e-12)
    # Each node moves some of the skin, apart from those that the palm hides under the bases of fingers.
    assert (basis.max(axis=0) > 0).mean() > 0.85


@pytest.mark.parametrize("side", get_args(Side))
def test_an_even_displacement_moves_each_vertex_along_its_normal(side: Side) -> None:
    plain = HandShape(side=side, scale=0.8)
    before, after = Skin.of(plain), Skin.of(plain.with_(displacement=np.full(NODES, 0.002)))
    moved = after.rest - before.rest
    np.testing.assert_allclose(moved, 0.8 * 0.002 * before.normals(before.rest), atol=1e-12)
    np.testing.assert_array_equal(after.faces, before.faces)


def test_a_left_hand_is_the_mirror_image_of_a_right_one() -> None:
    right, left = (Skin.of(HandShape(side=side, displacement=_drawn())) for side in ("right", "left"))
    np.testing.assert_allclose(left.rest, right.rest * [-1, 1, 1], atol=1e-12)


def test_a_node_moves_its_own_finger_alone() -> None:
    displacement = np.zeros(NODES)
    displacement[:56] = 0.002  # those of the thumb
    before, after = Skin.of(HandShape()), Skin.of(HandShape(displacement=displacement))
    moved = np.linalg.norm(after.rest - before.rest, axis=1)
    of_thumb = before.weights[:, 1:4].sum(axis=1)
    assert moved[of_thumb == 0].max() == 0
    np.testing.assert_allclose(moved[of_thumb == 1], 0.002, atol=1e-12)


def test_neighbours_of_an_even_displacement_do_not_differ() -> None:
    differences = neighbour_differences()
    np.testing.assert_allclose(differences @ np.ones(NODES), 0, atol=1e-15)
    # A ring of nodes has as many pairs as nodes; rows along a part one less.
    assert differences.shape[0] == 5 * (7 * 8 + 6 * 8) + 5 * 12 + 4 * 12


def test_the_hand_file_keeps_it() -> None:
    displacement = np.round(_drawn(), 6)
    hand = HandShape(displacement=displacement)
    fields = hand.to_fields()
    assert len(fields["skin_displacement_mm"]["palm"]) == 5
    again = HandShape.from_fields(fields)
    assert again.displacement is not None
    np.testing.assert_allclose(again.displacement, displacement, atol=1e-9)
    assert again == hand != HandShape()


def test_malformed_displacements_are_rejected() -> None:
    with pytest.raises(InputError, match="within 20 mm"):
        HandShape(displacement=np.full(NODES, 0.03))
    with pytest.raises(InputError, match="must be 340 numbers"):
        HandShape(displacement=np.zeros(7))
    with pytest.raises(InputError, match="must be 340 numbers"):
        HandShape(displacement=np.full(NODES, np.nan))
    fields = HandShape(displacement=np.zeros(NODES)).to_fields()
    fields["skin_displacement_mm"]["ring"] = [[0.0]]
    with pytest.raises(ValueError, match="ring must have 7 rows of 8"):
        HandShape.from_fields(fields)
