"""What surrounds the hand: other readings, and skin that is too near for a reading."""

from dataclasses import replace

import numpy as np
import pytest

from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.segmentation.skin_colour import SkinColourModel
from depthtrack.segmentation.surroundings import TOO_NEAR, mark_shadows
from tests.segmentation.test_segmenter import CLUTTERED, made

FOCAL_BASELINE = 50.0
"""Pixels times metres."""


def shadows_in(row: list[float]) -> list[bool]:
    """Return which pixels of a row may be shadows; each row of the frame is the same."""
    depth = np.tile(np.array(row, np.float32), (2, 1))
    out = np.ones(depth.shape, np.bool_)
    mark_shadows(depth, FOCAL_BASELINE, out)
    np.testing.assert_array_equal(out[0], out[1])
    return [bool(each) for each in out[0]]


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_shadow_is_as_far_from_its_surface_as_the_disparities_differ(mirrored: bool) -> None:
    # 50 / 1 - 50 / 2 = 25 pixels.
    row = [2.0] * 40 + [1.0] * 10 + [0.0] * 30 + [2.0] * 20
    expected = [False] * 50 + [True] * 25 + [False] * 25
    row, expected = (row[::-1], expected[::-1]) if mirrored else (row, expected)
    assert shadows_in(row) == expected


def test_a_shadow_may_lie_apart_from_its_surface() -> None:
    row = [1.0] * 10 + [2.0] * 10 + [0.0] * 10 + [2.0] * 20
    assert shadows_in(row)[20:30] == [True] * 10


def test_a_gap_in_a_wall_is_no_shadow() -> None:
    assert not any(shadows_in([2.0] * 20 + [0.0] * 20 + [2.0] * 20))


@pytest.mark.parametrize("sensor", ["kinect1", "kinect2", "realsense"])
@pytest.mark.parametrize("with_colour", [True, False])
def test_a_forearm_without_readings_surrounds_the_hand_by_its_colour(sensor: str, with_colour: bool) -> None:
    options = replace(CLUTTERED, sensor=sensor)  # type: ignore[arg-type]
    segmenter, shares, others = Segmenter(SkinColourModel.default()), [], []
    for index in range(0, 40, 4):
        frame, mask, wrist = made(options, index)
        found = segmenter.segment(frame)
        assert found is not None
        assert found.wrist is not None
        assert found.surroundings is not None
        # The forearm: readings at the hand's depth that are not the hand's, below the wrist.
        rows = np.arange(frame.depth.shape[0])[:, None]
        camera = frame.camera
        below = rows > camera.cy + camera.fy * wrist[1] / wrist[2] + 10
        arm = below & (frame.depth > 0) & (frame.depth < wrist[2] + 0.1) & ~mask
        # Without the arm's own shadow: a part of the shelf there has the colour of skin.
        lit = np.where(below & (frame.depth == 0), np.float32(2), frame.depth)
        near = replace(frame, depth=np.where(arm, np.float32(0), lit))
        seen = segmenter.segment(near if with_colour else replace(near, colour=None))
        assert seen is not None
        assert seen.surroundings is not None
        hidden = seen.surroundings == TOO_NEAR
        there = arm[seen.region.slices]
        if there.sum() > 200:
            shares.append(hidden[there].mean())
        others.append(np.count_nonzero(hidden & ~there) / np.count_nonzero(mask))
    if with_colour:
        assert len(shares) > 3
        assert np.median(shares) > 0.8
    else:
        assert not any(shares)
    assert max(others) < 0.05


def test_a_wall_of_skin_colour_out_of_range_does_not_hide_the_hand() -> None:
    frame, mask, _ = made(replace(CLUTTERED, sensor="kinect2"), 0)
    segmenter = Segmenter(SkinColourModel.default())
    found = segmenter.segment(frame)
    assert found is not None
    assert frame.colour is not None
    behind = frame.depth > frame.depth[mask].max() + 0.2
    skin = frame.colour[mask].mean(axis=0).astype(np.uint8)
    wall = replace(
        frame,
        depth=np.where(behind, np.float32(0), frame.depth),
        colour=np.where(behind[..., None], skin, frame.colour),
    )
    seen = segmenter.segment(wall)
    assert seen is not None
    assert seen.surroundings is not None
    # Small gaps between fingers may be left.
    assert np.count_nonzero(seen.surroundings == TOO_NEAR) < 0.03 * np.count_nonzero(mask)
