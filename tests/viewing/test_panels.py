"""Annotated frames and the pages composed of them: content, positions and sizes."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.errors import InputError
from depthtrack.geometry.rectangle import Rect
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import make_pose
from depthtrack.hand.shape import HandShape
from depthtrack.recording import Frame, GroundTruth, open_sequence
from depthtrack.viewing.annotated_frame import AnnotatedFrame, annotated_frames, evenly_spaced, true_keypoints
from depthtrack.viewing.contact_sheet import contact_sheet, save_picture
from depthtrack.viewing.depth_colours import depth_range
from depthtrack.viewing.panels import draw_layer, panel, tile_grid, useful_layers
from depthtrack.viewing.strip import strip
from depthtrack.viewing.theme import ESTIMATED_MASK, FINGER_COLOURS, OCCLUDER, TRUE_MASK
from tests.support.recordings import TIMES, joints_at, mask_at, write_sample
from tests.support.viewing import CAMERA, GREY, open_hand


def plane_frame(depth: float = 0.5, colour: int | None = 100, index: int = 0) -> AnnotatedFrame:
    """Return a frame of a plane with one depth and one grey."""
    pixels = None if colour is None else np.full((*CAMERA.shape, 3), colour, dtype=np.uint8)
    return AnnotatedFrame(Frame(index, 0.1 * index, np.full(CAMERA.shape, depth, dtype=np.float32), pixels, CAMERA))


# Annotated frames


def test_annotated_frames_have_mask_and_joints_of_their_own_frame(tmp_path: Path) -> None:
    sequence = open_sequence(write_sample(tmp_path / "sample"))
    for index, annotated in zip((1, 4), annotated_frames(sequence, (1, 4)), strict=True):
        assert annotated.frame.index == index
        assert annotated.mask_is_true
        assert annotated.mask is not None
        assert np.array_equal(annotated.mask, mask_at(index))
        assert annotated.keypoints is not None
        np.testing.assert_allclose(annotated.keypoints, joints_at(index))
    assert len(list(annotated_frames(sequence))) == len(TIMES)
    assert useful_layers(sequence) == ("depth", "colour", "mask", "skeleton")


def test_true_keypoints_are_computed_from_the_pose_without_joints() -> None:
    hand, pose = HandShape(side="left", scale=0.9), make_pose([0.0, 0.1, 0.5], [1.0, 0.2, 0.0, 0.1], np.full(20, 0.1))
    truth = GroundTruth(np.array([0.5, 1.0]), poses=np.stack([pose, pose + 0.01]), hand=hand)
    recording: Any = SimpleNamespace(ground_truth=truth, T_camera_world=np.eye(4))
    found = true_keypoints(recording, 0.5)
    assert found is not None
    np.testing.assert_allclose(found, HandModel(hand).keypoints(pose))
    assert true_keypoints(recording, 0.7) is None
    recording.T_camera_world = np.array([[0.0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 2], [0, 0, 0, 1]])
    turned = true_keypoints(recording, 0.5)
    assert turned is not None
    np.testing.assert_allclose(turned, np.stack([-found[:, 1], found[:, 0], found[:, 2] + 2], axis=-1))
    recording.ground_truth = GroundTruth(np.array([0.5]), poses=pose[None])
    assert true_keypoints(recording, 0.5) is None


def test_masks_are_estimated_only_without_a_true_mask(tmp_path: Path) -> None:
    sequence = open_sequence(write_sample(tmp_path / "sample"))
    for path in (tmp_path / "sample" / "hand_mask").glob("*.png"):
        if path.stem != "0.000000":
            path.unlink()
    estimated = np.zeros((24, 32), dtype=np.bool_)
    estimated[5:20, 5:20] = True
    found = list(annotated_frames(sequence, estimate=lambda frame: estimated if frame.index != 3 else None))
    assert [annotated.mask_is_true for annotated in found] == [True, False, False, False, False]
    assert [annotated.mask is None for annotated in found] == [False, False, False, True, False]
    assert np.any(np.all(draw_layer(found[1], "mask", 48, 0.4, 0.9) == ESTIMATED_MASK, axis=-1))
    assert not np.any(np.all(draw_layer(found[1], "mask", 48, 0.4, 0.9) == TRUE_MASK, axis=-1))


def test_a_crop_keeps_pixels_and_projections() -> None:
    rng = np.random.default_rng(2)
    colour = rng.integers(0, 256, (*CAMERA.shape, 3), dtype=np.uint8)
    mask = rng.random(CAMERA.shape) < 0.5
    whole = AnnotatedFrame(
        Frame(0, 0.0, rng.random(CAMERA.shape, dtype=np.float32), colour, CAMERA), mask, True, open_hand()
    )
    part = whole.cropped(Rect.of_size(-5, 100, 60, 170))
    assert part.mask is not None
    assert part.frame.colour is not None
    assert part.frame.depth.shape == part.camera.shape == (170, 60)
    assert np.array_equal(part.frame.depth[:140, 5:], whole.frame.depth[100:, :55])
    assert np.array_equal(part.frame.colour[:140, 5:], colour[100:, :55])
    assert not part.mask[140:].any()
    assert not part.mask[:, :5].any()
    np.testing.assert_allclose(part.camera.project(open_hand()), CAMERA.project(open_hand()) - [-5, 100])


@given(st.integers(0, 300), st.integers(1, 40))
def test_chosen_frames_are_evenly_spaced(length: int, count: int) -> None:
    chosen = evenly_spaced(length, count)
    assert len(chosen) == min(length, count)
    assert chosen == sorted(set(chosen))
    if chosen:
        gaps = np.diff([-1, *chosen, length])
        assert np.all(gaps >= 1)
        assert np.ptp(gaps[1:-1]) <= 1 if len(chosen) > 1 else True
        assert abs(chosen[0] - (length - 1 - chosen[-1])) <= 1


# Composed pictures


def test_tiles_are_in_reading_order() -> None:
    tiles = [np.full((4, 6, 3), 10 * number, dtype=np.uint8) for number in range(5)]
    grid = tile_grid(tiles, columns=3, gap=2)
    assert grid.shape == (10, 22, 3)
    assert [int(grid[6 * (n // 3), 8 * (n % 3), 0]) for n in range(5)] == [0, 10, 20, 30, 40]


def test_a_contact_sheet_shows_every_frame_in_order() -> None:
    greys = range(60, 240, 15)
    page = contact_sheet(
        [plane_frame(colour=grey, index=grey) for grey in greys], "title", "subtitle", 0.4, 0.6, width=900
    )
    assert 880 <= page.shape[1] <= 960
    corners = []
    for grey in greys:
        v, u = np.nonzero(np.all(page == grey, axis=-1))
        plain = np.bincount(v).argmax()
        assert len(v) > 5000, grey
        corners.append((plain // 40, u.min()))
    assert corners == sorted(corners)
    assert len({column for _, column in corners}) == 3


def test_a_contact_sheet_without_frames_raises_an_input_error() -> None:
    with pytest.raises(InputError, match="no readable frame"):
        contact_sheet([], "empty", "", 0.4, 0.6)


def test_panels_have_one_size_with_and_without_annotations() -> None:
    known = AnnotatedFrame(plane_frame().frame, np.ones(CAMERA.shape, dtype=np.bool_), True, open_hand())
    for layers in (("depth",), ("depth", "mask", "skeleton"), ("depth", "colour", "mask", "skeleton")):
        shapes = {
            panel(annotated, layers, 120, 0.4, 0.6).shape
            for annotated in (known, plane_frame(), plane_frame(colour=None))
        }
        assert len(shapes) == 1


@pytest.mark.parametrize("height", [60, 240, 700])
def test_skeleton_and_mask_align_at_any_resolution(height: int) -> None:
    """A keypoint in the skeleton and in a mask is at the same scaled pixels."""
    keypoints, mask = open_hand(), np.zeros(CAMERA.shape, dtype=np.bool_)
    tip = CAMERA.project(keypoints[8]).round().astype(int)
    mask[tip[1] - 4 : tip[1] + 5, tip[0] - 4 : tip[0] + 5] = True
    annotated = AnnotatedFrame(plane_frame(colour=0).frame, mask, True, keypoints)
    tinted = np.argwhere(np.any(draw_layer(annotated, "mask", height, 0.4, 0.6) > 0, axis=-1)).mean(axis=0)
    drawn = np.argwhere(
        np.all(
            np.abs(draw_layer(annotated, "skeleton", height, 0.4, 0.6).astype(int) - FINGER_COLOURS["index"]) <= 3,
            axis=-1,
        )
    )
    nearest = np.linalg.norm(drawn - tinted, axis=1).min()
    assert nearest <= 1.0


def test_an_object_before_the_hand_has_its_own_colour_and_legend_entry() -> None:
    mask, occluder = np.zeros((2, *CAMERA.shape), dtype=np.bool_)
    mask[100:150, 200:250], occluder[100:150, 250:280] = True, True
    bare = AnnotatedFrame(plane_frame(colour=0).frame, mask)
    holding = replace(bare, occluder=occluder)
    for layer in ("mask", "overview"):
        without, shown = (draw_layer(each, layer, CAMERA.height, 0.4, 0.6) for each in (bare, holding))
        assert np.all(np.any(shown != without, axis=-1) == occluder)
        assert np.all(shown[100, 250:280] == OCCLUDER)
    region = Rect(240, 90, 300, 160)
    cropped = holding.cropped(region).occluder
    assert cropped is not None
    np.testing.assert_array_equal(cropped, region.crop(occluder))
    legends = [contact_sheet([each], "sheet", "", 0.4, 0.6)[-40:] for each in (bare, holding)]
    assert [bool(np.all(legend == OCCLUDER, axis=-1).any()) for legend in legends] == [False, True]


def test_a_strip_crops_to_the_hand() -> None:
    mask = np.zeros(CAMERA.shape, dtype=np.bool_)
    mask[100:150, 200:250] = True
    shown = [AnnotatedFrame(plane_frame(index=n).frame, np.roll(mask, -10 * n, axis=1), True, None) for n in range(4)]
    banner = strip(shown, width=800)
    # Three rows (there is no skeleton) of four squares; the hand fills 50 of 60 pixels of a region's side.
    assert abs(banner.shape[1] - 800) <= 4
    side = (banner.shape[0] - 8) // 3
    lit = np.all(banner[-side:] == 100, axis=-1)
    assert 0.55 < lit.mean() < 0.75


def test_a_strip_of_too_many_frames_raises_an_input_error() -> None:
    with pytest.raises(InputError, match="room for 43"):
        strip([plane_frame()] * 44)


# Files


def test_a_failed_picture_leaves_no_file(tmp_path: Path) -> None:
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


def test_annotated_joints_project_into_the_annotated_silhouette(real_data: Path) -> None:
    """Joints and mask are projections of one model: joints outside mean a wrong camera."""
    sequence = open_sequence(real_data / "rgbd" / "open-close")
    for annotated in annotated_frames(sequence, evenly_spaced(len(sequence), 4)):
        assert annotated.mask is not None
        assert annotated.keypoints is not None
        u, v = annotated.camera.project(annotated.keypoints).round().astype(int).T
        assert annotated.mask[v, u].mean() > 0.8


@pytest.mark.parametrize("name", ["open-close", "with-ball", "kinect2-counting", "sr305-poses"])
def test_every_real_recording_has_a_contact_sheet_and_a_strip(real_data: Path, name: str) -> None:
    sequence = open_sequence(real_data / "rgbd" / name)
    shown = list(annotated_frames(sequence, evenly_spaced(len(sequence), 4)))
    near, far = depth_range(np.stack([annotated.frame.depth for annotated in shown]))
    page = contact_sheet(shown, name, "", near, far, width=600)
    assert page.std() > 10
    assert strip(shown, width=400).std() > 10
