"""The hand is found in depth alone by turned cameras, and beside bodies."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from depthtrack.geometry.camera import Camera
from depthtrack.recording import open_sequence
from depthtrack.recording.sequence import Frame
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.synthesis.generate import Synthesis, Synthesiser
from depthtrack.types import Array, Depth

SR305_HANDS = (
    *((230, 330), (235, 290), (270, 285), (300, 245), (330, 250)),
    *((300, 235), (310, 240), (265, 235), (260, 270), (340, 280)),
    *((300, 290), (315, 285), (310, 290), (310, 285), (310, 280)),
    *((325, 280), (330, 270), (330, 265), (340, 280)),
)
"""Column and row near the palm of each frame of `sr305-poses`, read from its pictures."""


@pytest.fixture(scope="module")
def made() -> Synthesiser:
    return Synthesiser(Synthesis(model="skin", sensor="kinect1", background="room", frames=12, seed=3))


def depth_of(made: Synthesiser, index: int) -> Depth:
    return made[index].depth.astype(np.float32)


def segmented(depth: Depth, camera: Camera) -> Observation | None:
    return Segmenter().segment(Frame(0, 0.0, np.ascontiguousarray(depth), None, camera))


def turned(depth: Depth, camera: Camera, quarters: int) -> tuple[Depth, Camera]:
    """Return a frame of a camera turned about its axis by quarters of a circle."""
    for _ in range(quarters):
        # np.rot90: column u becomes row width - 1 - u.
        cx, cy = camera.cy, camera.width - 1 - camera.cx
        camera = replace(camera, width=camera.height, height=camera.width, fx=camera.fy, fy=camera.fx, cx=cx, cy=cy)
        depth = np.rot90(depth)
    return np.ascontiguousarray(depth), camera


def rotated_back(centre: Array, quarters: int) -> Array:
    """Return a point of the turned camera in the frame of the upright one."""
    x, y, z = centre
    for _ in range(quarters):
        x, y = -y, x
    return np.array([x, y, z])


@pytest.mark.parametrize("quarters", [1, 2, 3], ids=["portrait", "upside down", "portrait, other way"])
def test_a_turned_camera_finds_the_same_hand(made: Synthesiser, quarters: int) -> None:
    for index in (0, 6):
        depth, camera = depth_of(made, index), made.sensor.camera
        upright, there = segmented(depth, camera), segmented(*turned(depth, camera, quarters))
        assert upright is not None
        assert there is not None
        assert np.linalg.norm(rotated_back(there.centre, quarters) - upright.centre) < 0.025


def test_the_hand_of_a_body_is_found_and_never_the_face(real_data: Path) -> None:
    """Each of 19 frames alone: the hand lies at, before or beside the body."""
    sequence = open_sequence(real_data / "rgbd" / "sr305-poses")
    apart = []
    for frame, place in zip(sequence, SR305_HANDS, strict=True):
        found = Segmenter().segment(frame)
        assert found is not None, f"frame {frame.index}"
        apart.append(float(np.hypot(*(frame.camera.project(found.centre) - place))))
    assert max(apart) < 75
