"""Marker models: posed markers, JSON round trip, rejected files."""

from pathlib import Path

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.hand.pose import make_pose
from depthtrack.hand.shape import HandShape
from depthtrack.markers.models.marker_model import MarkerModel


def hand_model() -> MarkerModel:
    return MarkerModel(
        "right", ("back", "tip"), np.array([0, 6]), np.array([[0, 0, -0.02], [0, 0.015, 0]]), np.zeros(2), HandShape()
    )


def test_markers_move_with_their_bodies() -> None:
    model = hand_model()
    pose = make_pose(np.array([0.1, 0.2, 0.3]), (1, 0, 0, 0), np.zeros(20))
    T = model.kinematics.transforms(pose)
    positions = model.positions(pose)
    np.testing.assert_allclose(positions[0], [0.1, 0.2, 0.28])
    np.testing.assert_allclose(positions[1], T[6, :3, :3] @ [0, 0.015, 0] + T[6, :3, 3])


def test_file_round_trip(tmp_path: Path) -> None:
    model = hand_model()
    (tmp_path / "model.json").write_text(model.to_json())
    again = MarkerModel.from_json(tmp_path / "model.json")
    assert again.to_json() == model.to_json()


def test_a_rigid_body_has_one_body() -> None:
    with pytest.raises(InputError, match="bodies 0 to 0, found 3"):
        MarkerModel("box", ("a",), np.array([3]), np.zeros((1, 3)), np.zeros(1))
