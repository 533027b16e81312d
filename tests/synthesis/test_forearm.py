"""The forearm: its mesh, its bend, and its place in the image."""

from typing import Any

import cv2
import numpy as np
import pytest

from depthtrack.hand.shape import HandShape
from depthtrack.synthesis.forearm import LARGEST_BEND, Forearm
from tests.support.synthesis import synthesiser


@pytest.mark.parametrize("model", ["primitives", "skin"])
@pytest.mark.parametrize("motion", ["everyday", "grasp", "random"])
def test_the_forearm_is_skin_outside_the_mask_and_connected_to_the_hand(model: Any, motion: str) -> None:
    made = synthesiser(motion=motion, model=model, forearm=True, seed=1)
    for index in range(0, len(made), 75):
        frame = made[index]
        forearm = frame.skin & ~frame.mask
        assert forearm.sum() > 0.2 * frame.mask.sum()
        pieces, _ = cv2.connectedComponents(frame.skin.astype(np.uint8))
        assert pieces == 2  # background and one arm
        # The forearm begins where the hand ends.
        beside = forearm & (cv2.dilate(frame.mask.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0)
        assert beside.any()


def test_the_wrist_bends_towards_the_elbow_within_its_limit() -> None:
    arm, palm = Forearm(HandShape()), np.eye(4)
    straight, slightly, far = ([0, -0.3, 0.0], [0, -0.3, 0.05], [0, 0.0, 0.3])
    assert np.linalg.norm(arm.bend(palm, np.array(straight))) == pytest.approx(0, abs=1e-9)
    np.testing.assert_allclose(arm.bend(palm, np.array(slightly)), [np.arctan2(-0.05, 0.254), 0, 0], atol=0.01)
    assert np.linalg.norm(arm.bend(palm, np.array(far))) < LARGEST_BEND
    frame = arm.frame(palm, arm.bend(palm, np.array(far)))
    np.testing.assert_allclose(frame[:3, :3] @ arm.shape.wrist + frame[:3, 3], arm.shape.wrist, atol=1e-12)


@pytest.mark.parametrize("side", ["right", "left"])
def test_the_forearm_is_a_closed_mesh_with_outward_normals(side: Any) -> None:
    arm = Forearm(HandShape(side=side, scale=1.1))
    vertices, normals = arm.mesh(np.eye(4), np.array([0.4, 0.1, -0.2]))
    faces = np.sort(arm.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert np.all(np.unique(faces, axis=0, return_counts=True)[1] == 2)
    a, b, c = (vertices[arm.faces[:, k]] for k in range(3))
    of_faces = np.cross(b - a, c - a)
    assert (
        np.einsum("ij,ij->", a, of_faces) / 6 > 5e-4
    )  # its volume exceeds half a litre, so faces are oriented outward
    agree = np.einsum("fkj,fj->fk", normals[arm.faces], of_faces)
    assert np.mean(agree > 0) > 0.99
