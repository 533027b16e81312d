"""Overlays: masks, skeletons and text are drawn only at their projected positions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from depthtrack.hand.kinematics import KEYPOINT_NAMES
from depthtrack.viewing.depth_colours import colour_scale, depth_range, depth_to_rgb, keypoint_depth_range
from depthtrack.viewing.overlay import FINGER_BONES, PALM_BONES, draw_skeleton, overlay_mask, spotlight
from depthtrack.viewing.text import put_text, text_width
from depthtrack.viewing.theme import FINGER_COLOURS, NO_READING, TRUE_MASK
from tests.support.viewing import CAMERA, GREY, open_hand


def lightness(image: NDArray[np.uint8]) -> NDArray[np.float64]:
    return image @ np.array([0.2126, 0.7152, 0.0722])


# Depth colours


def test_nearer_depth_is_never_dimmer_and_no_reading_is_darkest() -> None:
    depth = np.linspace(0.4, 2.0, 400, dtype=np.float32)[None]
    shades = lightness(depth_to_rgb(depth, 0.4, 2.0))[0]
    assert np.all(np.diff(shades) <= 1.0)  # rounding of the palette to bytes
    assert shades[0] > shades[200] > shades[-1] > lightness(np.array(NO_READING, dtype=np.uint8)) + 5


def test_missing_and_invalid_readings_have_the_colour_of_no_reading() -> None:
    depth = np.array([[0.0, np.nan, np.inf, -1.0, 0.7]], dtype=np.float32)
    colours = depth_to_rgb(depth, 0.4, 2.0)
    assert np.all(colours[0, :4] == NO_READING)
    assert np.any(colours[0, 4] != NO_READING)


def test_depth_outside_the_range_takes_the_colour_of_its_end() -> None:
    colours = depth_to_rgb(np.array([[0.2, 0.4, 2.0, 7.0]], dtype=np.float32), 0.4, 2.0)[0]
    assert np.array_equal(colours[0], colours[1])
    assert np.array_equal(colours[2], colours[3])
    assert np.array_equal(colour_scale(50, 3)[1, [0, -1]], colours[[1, 2]])


def test_depth_range_ignores_outliers_and_missing_readings() -> None:
    depth = np.linspace(0.5, 1.0, 100_000, dtype=np.float32)
    depth[:20_000] = 0
    depth[20_000:20_050] = 0.12
    depth[-50:] = 9.0
    near, far = depth_range(depth)
    assert near == pytest.approx(0.6, abs=0.01)
    assert far == pytest.approx(0.99, abs=0.01)


@pytest.mark.parametrize("depth", [np.zeros((4, 4)), np.full((4, 4), 0.7), np.full((4, 4), np.nan)])
def test_depth_range_is_never_empty(depth: NDArray[np.float64]) -> None:
    near, far = depth_range(depth.astype(np.float32))
    assert 0 < near < far


def test_keypoint_depth_range_contains_the_hand_and_the_margin() -> None:
    keypoints = open_hand()
    near, far = keypoint_depth_range(keypoints, margin=0.2)
    assert 0 < near < keypoints[:, 2].min()
    assert far == pytest.approx(keypoints[:, 2].max() + 0.2, abs=0.06)
    assert keypoint_depth_range(keypoints[:0]) == depth_range(np.zeros((4, 4), dtype=np.float32))


# Masks


def test_overlay_mask_tints_only_the_inside_of_a_new_image() -> None:
    image = np.random.default_rng(1).integers(0, 256, (60, 80, 3), dtype=np.uint8)
    before, mask = image.copy(), np.zeros((60, 80), dtype=np.bool_)
    mask[20:40, 30:60] = True
    out = overlay_mask(image, mask, TRUE_MASK, opacity=0.5)
    assert np.array_equal(image, before)
    assert np.array_equal(out[~mask], image[~mask])
    assert np.all(out[20, 30:60] == TRUE_MASK)
    expected = (image[30, 45].astype(float) + TRUE_MASK) / 2
    assert np.all(np.abs(out[30, 45] - expected) <= 0.5)


def test_spotlight_keeps_the_hand_and_dims_the_rest() -> None:
    mask = np.zeros((240, 320), dtype=np.bool_)
    mask[50:90, 60:100] = True
    out = spotlight(GREY, mask)
    assert np.array_equal(out[mask], GREY[mask])
    assert np.all(lightness(out[~mask]) < 0.5 * lightness(GREY[~mask]))


# Skeletons


def test_every_joint_is_drawn_at_its_projection() -> None:
    keypoints = open_hand()
    out = draw_skeleton(GREY, CAMERA, keypoints, thickness=3)
    for name, (u, v) in zip(KEYPOINT_NAMES, CAMERA.project(keypoints), strict=True):
        if name.endswith("tip"):
            assert np.all(np.abs(out[round(v), round(u)].astype(int) - FINGER_COLOURS[name.split("_")[0]]) <= 3), name
        assert np.any(out[round(v), round(u)] != 90), name


def test_nothing_is_drawn_away_from_the_bones() -> None:
    keypoints = open_hand()
    changed = np.argwhere(np.any(draw_skeleton(GREY, CAMERA, keypoints, thickness=3) != GREY, axis=-1))[:, ::-1]
    pixels = CAMERA.project(keypoints)
    bones = [*PALM_BONES, *(bone for chain in FINGER_BONES.values() for bone in chain)]
    distance = np.min([_distance_to_segment(changed, pixels[a], pixels[b]) for a, b in bones], axis=0)
    assert distance.max() < 6
    assert len(changed) > 500


def _distance_to_segment(
    points: NDArray[np.int64], start: NDArray[np.float64], end: NDArray[np.float64]
) -> NDArray[np.float64]:
    along = np.clip((points - start) @ (end - start) / np.sum((end - start) ** 2), 0, 1)
    return np.asarray(np.linalg.norm(points - (start + along[:, None] * (end - start)), axis=1))


def test_bones_connect_all_keypoints_of_each_finger_to_the_wrist() -> None:
    reached = {0}
    bones = [*PALM_BONES, *(bone for chain in FINGER_BONES.values() for bone in chain)]
    for _ in bones:
        reached |= {b for a, b in bones if a in reached}
    assert reached == set(range(21))
    for finger, chain in FINGER_BONES.items():
        assert all(KEYPOINT_NAMES[k].startswith(finger) for bone in chain for k in bone)


def test_a_nearer_finger_covers_a_farther_one() -> None:
    keypoints = np.full((21, 3), np.nan)
    index, ring = KEYPOINT_NAMES.index("index_mcp"), KEYPOINT_NAMES.index("ring_mcp")
    for near, far, front in ((index, ring, "index"), (ring, index, "ring")):
        keypoints[near : near + 2] = [[-0.05, 0, 0.4], [0.05, 0, 0.4]]
        keypoints[far : far + 2] = [[0, -0.06, 0.5], [0, 0.06, 0.5]]
        u, v = CAMERA.project([0, 0, 0.4]).round().astype(int)
        crossing = draw_skeleton(GREY, CAMERA, keypoints, thickness=5)[v, u]
        assert np.all(np.abs(crossing.astype(int) - FINGER_COLOURS[front]) <= 3)


@given(st.integers(0, 20), st.sampled_from([np.nan, -0.5, 0.0, 1e-9, 1e9]), st.sampled_from([0.0, 1e12, -1e12]))
def test_invalid_keypoints_are_omitted(which: int, z: float, x: float) -> None:
    keypoints = open_hand()
    keypoints[which] = [x, 0.0, z]
    assert np.any(draw_skeleton(GREY, CAMERA, keypoints) != GREY)


def test_keypoints_of_another_shape_raise_a_value_error() -> None:
    with pytest.raises(ValueError, match="21, 3"):
        draw_skeleton(GREY, CAMERA, np.zeros((20, 3)))


# Text


def test_text_has_the_reported_width_and_is_clipped_at_the_image() -> None:
    canvas = np.zeros((40, 300, 3), dtype=np.uint8)
    put_text(canvas, "frame 12", (20, 20), 16, (255, 255, 255))
    v, u = np.nonzero(canvas[..., 0])
    assert 20 <= u.min() < 24
    assert abs(u.max() + 1 - (20 + text_width("frame 12", 16))) <= 3
    assert abs((v.min() + v.max()) / 2 - 20) <= 3
    for position in ((-15, 2), (290, 38), (500, 20), (-500, -500)):
        put_text(canvas, "frame 12", position, 16)


@pytest.mark.parametrize("size", [13, 24])
def test_words_are_separated_by_a_space(size: int) -> None:
    assert text_width("24 frames", size) - text_width("24frames", size) >= 0.3 * size
