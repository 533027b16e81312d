"""Drawing: what is painted lies where the camera sees it, and nowhere else."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from depthtrack.camera import Camera
from depthtrack.errors import InputError
from depthtrack.hand.kinematics import KEYPOINT_NAMES, HandModel
from depthtrack.hand.pose import make_pose
from depthtrack.hand.shape import HandShape
from depthtrack.recording import Frame, GroundTruth, open_sequence
from depthtrack.viewing.contact_sheet import contact_sheet, save_picture
from depthtrack.viewing.depth_colours import colour_scale, depth_range, depth_to_rgb
from depthtrack.viewing.moments import Moment, evenly_chosen, moments, true_keypoints
from depthtrack.viewing.overlay import FINGER_BONES, PALM_BONES, draw_skeleton, overlay_mask, spotlight
from depthtrack.viewing.panels import paint, panel, tile_grid, useful_layers
from depthtrack.viewing.strip import strip
from depthtrack.viewing.text import put_text, text_width
from depthtrack.viewing.theme import ESTIMATED_MASK, FINGER_COLOURS, NO_READING, TRUE_MASK
from tests.recording_samples import TIMES, joints_at, mask_at, write_sample

CAMERA = Camera(320, 240, 280.0, 290.0, 158.0, 121.5)
GREY = np.full((240, 320, 3), 90, dtype=np.uint8)


def open_hand() -> NDArray[np.float64]:
    """Keypoints (21, 3) of an open right hand, its palm towards the camera at 0.4 m."""
    pose = make_pose([0.0, 0.02, 0.4], [0.0, 1.0, 0.0, 0.0], np.zeros(20))
    return HandModel(HandShape()).keypoints(pose)


def moment(depth: float = 0.5, colour: int | None = 100, index: int = 0) -> Moment:
    """A plane of one depth and one grey."""
    pixels = None if colour is None else np.full((*CAMERA.shape, 3), colour, dtype=np.uint8)
    return Moment(Frame(index, 0.1 * index, np.full(CAMERA.shape, depth, dtype=np.float32), pixels, CAMERA))


def lightness(image: NDArray[np.uint8]) -> NDArray[np.float64]:
    return image @ np.array([0.2126, 0.7152, 0.0722])


# Depth colours


def test_nearer_depth_is_never_dimmer_and_no_reading_is_darkest() -> None:
    depth = np.linspace(0.4, 2.0, 400, dtype=np.float32)[None]
    shades = lightness(depth_to_rgb(depth, 0.4, 2.0))[0]
    assert np.all(np.diff(shades) <= 1.0)  # rounding of the palette to bytes
    assert shades[0] > shades[200] > shades[-1] > lightness(np.array(NO_READING, dtype=np.uint8)) + 5


def test_missing_and_broken_readings_have_the_colour_of_no_reading() -> None:
    depth = np.array([[0.0, np.nan, np.inf, -1.0, 0.7]], dtype=np.float32)
    colours = depth_to_rgb(depth, 0.4, 2.0)
    assert np.all(colours[0, :4] == NO_READING)
    assert np.any(colours[0, 4] != NO_READING)


def test_depth_outside_the_range_takes_the_colour_of_its_end() -> None:
    colours = depth_to_rgb(np.array([[0.2, 0.4, 2.0, 7.0]], dtype=np.float32), 0.4, 2.0)[0]
    assert np.array_equal(colours[0], colours[1])
    assert np.array_equal(colours[2], colours[3])
    assert np.array_equal(colour_scale(50, 3)[1, [0, -1]], colours[[1, 2]])


def test_depth_range_ignores_specks_and_missing_readings() -> None:
    depth = np.linspace(0.5, 1.0, 100_000, dtype=np.float32)
    depth[:20_000] = 0
    depth[20_000:20_050] = 0.12
    depth[-50:] = 9.0
    near, far = depth_range(depth)
    assert near == pytest.approx(0.6, abs=0.01)
    assert far == pytest.approx(0.99, abs=0.01)


@pytest.mark.parametrize("depth", [np.zeros((4, 4)), np.full((4, 4), 0.7), np.full((4, 4), np.nan)])
def test_depth_range_always_spans_something(depth: NDArray[np.float64]) -> None:
    near, far = depth_range(depth.astype(np.float32))
    assert 0 < near < far


# Masks


def test_mask_tints_inside_only_and_leaves_the_input_alone() -> None:
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


def test_every_joint_is_drawn_where_the_camera_projects_it() -> None:
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


def test_the_bones_join_all_keypoints_of_each_finger_to_the_wrist() -> None:
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
def test_impossible_keypoints_are_left_out_without_harm(which: int, z: float, x: float) -> None:
    keypoints = open_hand()
    keypoints[which] = [x, 0.0, z]
    assert np.any(draw_skeleton(GREY, CAMERA, keypoints) != GREY)


def test_a_skeleton_of_another_size_is_refused() -> None:
    with pytest.raises(ValueError, match="21, 3"):
        draw_skeleton(GREY, CAMERA, np.zeros((20, 3)))


# Moments


def test_moments_bring_mask_and_joints_of_their_own_frame(tmp_path: Path) -> None:
    sequence = open_sequence(write_sample(tmp_path / "sample"))
    for index, seen in zip((1, 4), moments(sequence, (1, 4)), strict=True):
        assert seen.frame.index == index
        assert seen.mask_is_true
        assert seen.mask is not None
        assert np.array_equal(seen.mask, mask_at(index))
        assert seen.keypoints is not None
        np.testing.assert_allclose(seen.keypoints, joints_at(index))
    assert len(list(moments(sequence))) == len(TIMES)
    assert useful_layers(sequence) == ("depth", "colour", "mask", "skeleton")


def test_keypoints_come_from_the_pose_where_no_joints_are_given() -> None:
    hand, pose = HandShape(side="left", scale=0.9), make_pose([0.0, 0.1, 0.5], [1.0, 0.2, 0.0, 0.1], np.full(20, 0.1))
    truth = GroundTruth(np.array([0.5, 1.0]), poses=np.stack([pose, pose + 0.01]), hand=hand)
    found = true_keypoints(truth, 0.5)
    assert found is not None
    np.testing.assert_allclose(found, HandModel(hand).keypoints(pose))
    assert true_keypoints(truth, 0.7) is None
    assert true_keypoints(GroundTruth(np.array([0.5]), poses=pose[None]), 0.5) is None


def test_an_estimate_is_asked_only_where_no_mask_is_known(tmp_path: Path) -> None:
    sequence = open_sequence(write_sample(tmp_path / "sample"))
    for path in (tmp_path / "sample" / "hand_mask").glob("*.png"):
        if path.stem != "0.000000":
            path.unlink()
    estimated = np.zeros((24, 32), dtype=np.bool_)
    estimated[5:20, 5:20] = True
    found = list(moments(sequence, estimate=lambda frame: estimated if frame.index != 3 else None))
    assert [seen.mask_is_true for seen in found] == [True, False, False, False, False]
    assert [seen.mask is None for seen in found] == [False, False, False, True, False]
    assert np.any(np.all(paint(found[1], "mask", 48, 0.4, 0.9) == ESTIMATED_MASK, axis=-1))
    assert not np.any(np.all(paint(found[1], "mask", 48, 0.4, 0.9) == TRUE_MASK, axis=-1))


def test_a_crop_sees_the_same_points_of_space_in_the_same_colours() -> None:
    rng = np.random.default_rng(2)
    colour = rng.integers(0, 256, (*CAMERA.shape, 3), dtype=np.uint8)
    mask = rng.random(CAMERA.shape) < 0.5
    whole = Moment(Frame(0, 0.0, rng.random(CAMERA.shape, dtype=np.float32), colour, CAMERA), mask, True, open_hand())
    part = whole.cropped(-5, 100, 60, 170)
    assert part.mask is not None
    assert part.frame.colour is not None
    assert part.frame.depth.shape == part.camera.shape == (170, 60)
    assert np.array_equal(part.frame.depth[:140, 5:], whole.frame.depth[100:, :55])
    assert np.array_equal(part.frame.colour[:140, 5:], colour[100:, :55])
    assert not part.mask[140:].any()
    assert not part.mask[:, :5].any()
    np.testing.assert_allclose(part.camera.project(open_hand()), CAMERA.project(open_hand()) - [-5, 100])


@given(st.integers(0, 300), st.integers(1, 40))
def test_chosen_frames_are_spread_evenly(length: int, count: int) -> None:
    chosen = evenly_chosen(length, count)
    assert len(chosen) == min(length, count)
    assert chosen == sorted(set(chosen))
    if chosen:
        gaps = np.diff([-1, *chosen, length])
        assert np.all(gaps >= 1)
        assert np.ptp(gaps[1:-1]) <= 1 if len(chosen) > 1 else True
        assert abs(chosen[0] - (length - 1 - chosen[-1])) <= 1


# Composed pictures


def test_tiles_stand_in_reading_order() -> None:
    tiles = [np.full((4, 6, 3), 10 * number, dtype=np.uint8) for number in range(5)]
    grid = tile_grid(tiles, columns=3, gap=2)
    assert grid.shape == (10, 22, 3)
    assert [int(grid[6 * (n // 3), 8 * (n % 3), 0]) for n in range(5)] == [0, 10, 20, 30, 40]


def test_a_contact_sheet_shows_every_moment_in_order() -> None:
    greys = range(60, 240, 15)
    page = contact_sheet([moment(colour=grey, index=grey) for grey in greys], "title", "subtitle", 0.4, 0.6, width=900)
    assert 880 <= page.shape[1] <= 960
    corners = []
    for grey in greys:
        v, u = np.nonzero(np.all(page == grey, axis=-1))
        plain = np.bincount(v).argmax()
        assert len(v) > 5000, grey
        corners.append((plain // 40, u.min()))
    assert corners == sorted(corners)
    assert len({column for _, column in corners}) == 3


def test_a_contact_sheet_of_nothing_is_refused() -> None:
    with pytest.raises(InputError, match="no readable frame"):
        contact_sheet([], "empty", "", 0.4, 0.6)


def test_panels_have_one_size_whatever_is_missing() -> None:
    known = Moment(moment().frame, np.ones(CAMERA.shape, dtype=np.bool_), True, open_hand())
    for layers in (("depth",), ("depth", "mask", "skeleton"), ("depth", "colour", "mask", "skeleton")):
        shapes = {panel(seen, layers, 120, 0.4, 0.6).shape for seen in (known, moment(), moment(colour=None))}
        assert len(shapes) == 1


@pytest.mark.parametrize("height", [60, 240, 700])
def test_skeleton_and_mask_meet_at_any_resolution(height: int) -> None:
    """The hand's keypoints, drawn and as a mask of their own, land on the same scaled pixels."""
    keypoints, mask = open_hand(), np.zeros(CAMERA.shape, dtype=np.bool_)
    tip = CAMERA.project(keypoints[8]).round().astype(int)
    mask[tip[1] - 4 : tip[1] + 5, tip[0] - 4 : tip[0] + 5] = True
    seen = Moment(moment(colour=0).frame, mask, True, keypoints)
    tinted = np.argwhere(np.any(paint(seen, "mask", height, 0.4, 0.6) > 0, axis=-1)).mean(axis=0)
    drawn = np.argwhere(
        np.all(np.abs(paint(seen, "skeleton", height, 0.4, 0.6).astype(int) - FINGER_COLOURS["index"]) <= 3, axis=-1)
    )
    nearest = np.linalg.norm(drawn - tinted, axis=1).min()
    assert nearest <= 1.0


def test_a_strip_looks_close_at_the_hand() -> None:
    mask = np.zeros(CAMERA.shape, dtype=np.bool_)
    mask[100:150, 200:250] = True
    shown = [Moment(moment(index=n).frame, np.roll(mask, -10 * n, axis=1), True, None) for n in range(4)]
    banner = strip(shown, width=800)
    # Three rows (no skeleton is known) of four squares; the hand fills 50 of 60 pixels of its window's side.
    assert abs(banner.shape[1] - 800) <= 4
    side = (banner.shape[0] - 8) // 3
    lit = np.all(banner[-side:] == 100, axis=-1)
    assert 0.55 < lit.mean() < 0.75


def test_a_strip_of_too_many_moments_is_refused() -> None:
    with pytest.raises(InputError, match="room for 43"):
        strip([moment()] * 44)


def test_text_stays_inside_the_image_and_is_as_wide_as_told() -> None:
    canvas = np.zeros((40, 300, 3), dtype=np.uint8)
    put_text(canvas, "frame 12", (20, 20), 16, (255, 255, 255))
    v, u = np.nonzero(canvas[..., 0])
    assert 20 <= u.min() < 24
    assert abs(u.max() + 1 - (20 + text_width("frame 12", 16))) <= 3
    assert abs((v.min() + v.max()) / 2 - 20) <= 3
    for position in ((-15, 2), (290, 38), (500, 20), (-500, -500)):
        put_text(canvas, "frame 12", position, 16)


# Files


def test_a_picture_is_complete_or_absent(tmp_path: Path) -> None:
    (tmp_path / "taken.png").mkdir()
    with pytest.raises(InputError, match="cannot write"):
        save_picture(GREY, tmp_path / "taken.png")
    with pytest.raises(InputError, match="cannot write"):
        save_picture(GREY, tmp_path / "nowhere" / "a.png")
    with pytest.raises(InputError, match=r"\.png"):
        save_picture(GREY, tmp_path / "a.gif")
    assert [path.name for path in tmp_path.iterdir()] == ["taken.png"]


@pytest.mark.parametrize(("name", "error"), [("a.png", 0), ("a.jpg", 4)])
def test_a_picture_reads_back_in_its_colours(tmp_path: Path, name: str, error: int) -> None:
    image = np.full((40, 30, 3), (200, 100, 30), dtype=np.uint8)
    save_picture(image, tmp_path / name)
    found = cv2.imread(str(tmp_path / name))
    assert found is not None
    assert np.abs(found[..., ::-1].astype(int) - image).max() <= error
    assert [path.name for path in tmp_path.iterdir()] == [name]


# Real recordings


def test_annotated_joints_lie_on_the_annotated_silhouette(real_data: Path) -> None:
    """The annotation is the projection of one model: drawn joints that left the mask would mean a wrong camera."""
    sequence = open_sequence(real_data / "rgbd" / "open-close")
    for seen in moments(sequence, evenly_chosen(len(sequence), 4)):
        assert seen.mask is not None
        assert seen.keypoints is not None
        u, v = seen.camera.project(seen.keypoints).round().astype(int).T
        assert seen.mask[v, u].mean() > 0.8


@pytest.mark.parametrize("name", ["open-close", "with-ball", "kinect2-counting", "sr305-poses"])
def test_every_real_recording_makes_a_page(real_data: Path, name: str) -> None:
    sequence = open_sequence(real_data / "rgbd" / name)
    shown = list(moments(sequence, evenly_chosen(len(sequence), 4)))
    near, far = depth_range(np.stack([seen.frame.depth for seen in shown]))
    page = contact_sheet(shown, name, "", near, far, width=600)
    assert page.std() > 10
    assert strip(shown, width=400).std() > 10
