"""The wrist of a forearm that points at the camera."""

from dataclasses import replace

import numpy as np
import pytest

from depthtrack.hand.primitives import CYLINDER, SPHERE, cone, ellipsoid
from depthtrack.recording.sequence import Frame
from depthtrack.rendering.raycast import raycast
from depthtrack.segmentation.forearm import Arm, find_arm
from depthtrack.segmentation.foreshortened_wrist import breadth_across, find_foreshortened_wrist, points_at_camera
from depthtrack.segmentation.grid import Grid
from depthtrack.segmentation.options import ForearmOptions, ForeshortenedWristOptions
from depthtrack.segmentation.palm import Palm
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.synthesis.generate import Synthesis, Synthesiser
from tests.support.arms import CAMERA, WRIST, club, nearest_palm

OPTIONS = ForeshortenedWristOptions()
SLANT = np.radians(68)
AXIS = np.array([0.0, np.cos(SLANT), -np.sin(SLANT)])
RADIUS, BREADTH, END = 0.025, 0.104, 0.05
"""Metres: radius of the tube, breadth of the fist, and its extent along the tube."""


def fist_before_the_camera() -> tuple[Grid, Palm, Arm]:
    """Return a broad fist whose tube points at the camera."""
    c, s = np.cos(-SLANT), np.sin(-SLANT)
    turn = np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0.55], [0, 0, 0, 1.0]])
    fist = ellipsoid((0.0, 0.0, 0.0), (BREADTH / 2, END, 0.035))
    parts = np.stack([turn @ part for part in (fist, cone((0.0, 0.0, 0.0), 0.25, RADIUS, RADIUS))])
    depth = raycast(CAMERA, np.array([SPHERE, CYLINDER]), parts, np.arange(2)).depth.astype(np.float32)
    return *nearest_palm(depth), Arm(AXIS, np.empty(0, dtype=np.int64))


def test_the_breadth_of_a_tube_is_its_diameter() -> None:
    grid, palm, arm = fist_before_the_camera()
    profile = breadth_across(grid, palm, arm, OPTIONS)
    places = (np.arange(len(profile)) + 0.5) * OPTIONS.bin_width - OPTIONS.before + palm.centre @ AXIS
    from_fist = places - np.array([0, 0, 0.55]) @ AXIS
    tube = profile[(from_fist > END + 0.02) & (from_fist < 0.15)]
    assert len(tube) > 10
    np.testing.assert_allclose(tube, 2 * RADIUS, atol=0.012)
    assert profile.max() > 0.8 * BREADTH


def test_the_wrist_is_where_the_fist_ends() -> None:
    grid, palm, arm = fist_before_the_camera()
    assert points_at_camera(palm, arm, OPTIONS)
    found = find_foreshortened_wrist(grid, palm, arm, 0.15, OPTIONS)
    assert found is not None
    wrist = (palm.centre + found * AXIS - [0, 0, 0.55]) @ AXIS
    assert wrist == pytest.approx(END, abs=0.02)


def test_a_tube_without_a_fist_has_no_wrist() -> None:
    grid, palm, arm = fist_before_the_camera()
    assert find_foreshortened_wrist(grid, palm, arm, 0.15, replace(OPTIONS, broad_ratio=3.0)) is None


@pytest.mark.parametrize("degrees", [0, 50])
def test_an_arm_across_the_line_of_sight_is_no_special_case(degrees: float) -> None:
    grid, palm = club(np.radians(degrees))
    arm = find_arm(grid, palm, WRIST, ForearmOptions())
    assert arm is not None
    assert not points_at_camera(palm, arm, OPTIONS)


def test_a_grasp_over_the_forearm_is_cut_at_its_wrist() -> None:
    recording = Synthesiser(
        Synthesis("grasp", viewpoint=4, model="skin", background="room", sensor="realsense", frames=90)
    )
    segmenter, errors = Segmenter(), list[float]()
    for index in range(15, 90, 15):
        segmenter.reset()
        shown = recording[index]
        frame = Frame(index, shown.timestamp, shown.depth.astype(np.float32), None, recording.sensor.camera)
        observation = segmenter.segment(frame)
        assert observation is not None
        assert observation.wrist is not None
        errors.append((observation.wrist.point - recording.joints[index, 0]) @ observation.wrist.normal)
    assert abs(np.median(errors)) < 0.02
