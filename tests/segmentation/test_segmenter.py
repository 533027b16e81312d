"""Segmentation of synthetic frames: silhouette, wrist, other objects, and borders."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.hand.primitives import SPHERE, sphere
from depthtrack.recording.sequence import Frame
from depthtrack.rendering.raycast import raycast
from depthtrack.segmentation.hand_detection import DetectedHand, HandDetector
from depthtrack.segmentation.hand_size import AVERAGE_HAND
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.options import SearchWindowOptions, SegmentationOptions
from depthtrack.segmentation.roi_tracking import RoiPrior
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.segmentation.skin_colour import SkinColourModel
from depthtrack.segmentation.wrist import WristPlane
from depthtrack.synthesis.generate import Synthesis, Synthesiser

Mask = np.ndarray
CLUTTERED = Synthesis(motion="everyday", sensor="kinect1", background="room", model="skin", seed=22)


@cache
def made(options: Synthesis, index: int) -> tuple[Frame, Mask, np.ndarray]:
    """Return a frame, the true silhouette (h, w) and the wrist (3,), metres, camera frame."""
    synthesiser = _synthesiser(options)
    frame = synthesiser[index]
    depth = frame.depth.astype(np.float32)
    return Frame(index, frame.timestamp, depth, frame.colour, synthesiser.sensor.camera), frame.mask, frame.joints[0]


@cache
def _synthesiser(options: Synthesis) -> Synthesiser:
    return Synthesiser(options)


def without_colour(frame: Frame) -> Frame:
    """Return the frame with depth only."""
    return replace(frame, colour=None)


def iou(found: Observation | None, mask: Mask) -> float:
    """Return the IoU with the true silhouette (h, w); 0 without an observation."""
    if found is None:
        return 0.0
    whole = np.zeros_like(mask)
    whole[found.region.slices] = found.silhouette
    return float(np.sum(whole & mask) / np.sum(whole | mask))


def test_a_hand_with_forearm_in_a_cluttered_room() -> None:
    """A bookshelf of skin's colour is right behind the hand, a face beside it."""
    segmenter = Segmenter(SkinColourModel.default())
    ious, wrists = [], []
    for index in range(0, 40, 2):
        frame, mask, wrist = made(CLUTTERED, index)
        found = segmenter.segment(frame)
        ious.append(iou(found, mask))
        assert found is not None
        assert found.wrist is not None
        wrists.append((wrist - found.wrist.point) @ found.wrist.normal)
    assert np.mean(ious) > 0.95
    assert np.abs(wrists).max() < 0.015


def test_readings_around_the_hand_are_its_surroundings() -> None:
    frame, _, _ = made(CLUTTERED, 0)
    found = Segmenter(SkinColourModel.default()).segment(frame)
    assert found is not None
    assert found.surroundings is not None
    assert found.frame_camera == frame.camera
    assert not (found.surroundings[found.silhouette] > 0).any()
    around = ~found.silhouette
    np.testing.assert_array_equal(found.surroundings[around], frame.depth[found.region.slices][around])


@pytest.mark.parametrize("sensor", ["kinect1", "kinect2", "realsense"])
def test_any_frame_can_be_the_first(sensor: str) -> None:
    options = Synthesis(motion="signs", sensor=sensor, background="room", seed=3)  # type: ignore[arg-type]
    for index in (0, 60, 150):
        frame, mask, _ = made(options, index)
        assert iou(Segmenter(SkinColourModel.default()).segment(frame), mask) > 0.8
        assert iou(Segmenter(None).segment(frame), mask) > 0.75


def test_the_background_in_a_ring_of_fingers_is_no_hand() -> None:
    """Thumb and index touch; the shelf behind them has the colour of skin."""
    segmenter = Segmenter(SkinColourModel.default())
    for index in range(284, 296, 2):
        frame, mask, _ = made(CLUTTERED, index)
        found = segmenter.segment(frame)
    assert found is not None
    whole = np.zeros_like(mask)
    whole[found.region.slices] = found.silhouette
    behind = ~mask & (frame.depth > 1.0)
    assert np.sum(whole & behind) < 0.01 * np.sum(mask)


@pytest.mark.parametrize("model", ["skin", "primitives"])
def test_hands_of_both_kinds_are_cut_at_the_same_wrist(model: str) -> None:
    options = replace(CLUTTERED, model=model)  # type: ignore[arg-type]
    segmenter = Segmenter(SkinColourModel.default())
    ious = []
    for index in range(200, 240, 4):
        frame, mask, _ = made(options, index)
        ious.append(iou(segmenter.segment(frame), mask))
    assert np.mean(ious) > 0.94


def test_depth_alone_follows_the_hand() -> None:
    segmenter = Segmenter(None)
    for index in range(0, 20, 2):
        frame, mask, _ = made(CLUTTERED, index)
        assert iou(segmenter.segment(without_colour(frame)), mask) > 0.85


def test_a_hand_without_an_arm_is_not_cut() -> None:
    frame, mask, _ = made(Synthesis(motion="everyday", sensor="ideal", forearm=False), 0)
    found = Segmenter(SkinColourModel.default()).segment(frame)
    assert found is not None
    assert found.wrist is None
    assert found.arm_direction is None
    assert iou(found, mask) > 0.97


def test_the_arm_points_from_hand_to_forearm() -> None:
    frame, _, wrist = made(CLUTTERED, 0)
    found = Segmenter(SkinColourModel.default()).segment(frame)
    assert found is not None
    assert found.arm_direction is not None
    along = wrist - found.centre
    assert along @ found.arm_direction > 0.9 * np.linalg.norm(along)
    assert np.linalg.norm(along) == pytest.approx(0.06, abs=0.03)


def test_a_hand_is_found_at_another_palm_of_the_same_arm(monkeypatch: pytest.MonkeyPatch) -> None:
    """The most likely palm lies where the region near it shows none."""
    frame, mask, _ = made(CLUTTERED, 0)
    usual = Segmenter(SkinColourModel.default()).segment(frame)
    assert usual is not None
    detect = HandDetector.detect

    def with_bad_first(step: float) -> Callable[..., list[DetectedHand]]:
        def detected(self: HandDetector, *arguments: Any) -> list[DetectedHand]:
            found = detect(self, *arguments)
            return [DetectedHand(found[0].centre - [0, 0, step], -1.0), *found]

        return detected

    monkeypatch.setattr(HandDetector, "detect", with_bad_first(0.18))
    assert iou(Segmenter(SkinColourModel.default()).segment(frame), mask) == pytest.approx(iou(usual, mask), abs=0.02)
    monkeypatch.setattr(HandDetector, "detect", with_bad_first(0.4))
    assert Segmenter(SkinColourModel.default()).segment(frame) is None


def test_a_segmentation_around_a_prior_leaves_the_state() -> None:
    one, other = Segmenter(SkinColourModel.default()), Segmenter(SkinColourModel.default())
    for index in range(0, 12, 3):
        frame, mask, wrist = made(CLUTTERED, index)
        expected, found = one.segment(frame), other.segment(frame)
        assert expected is not None
        assert found is not None
        np.testing.assert_array_equal(found.depth, expected.depth)
        to_arm = (wrist - found.centre) / np.linalg.norm(wrist - found.centre)
        prior = RoiPrior(found.centre, WristPlane(wrist, to_arm), AVERAGE_HAND)
        assert iou(other.around(frame, prior), mask) > 0.9


def test_an_empty_room_has_no_hand() -> None:
    frame, _, _ = made(CLUTTERED, 0)
    # Beyond a metre are the bookshelf, of skin's colour, the table, and a bystander with a face.
    far = frame.depth * (frame.depth > 1.0)
    empty = replace(frame, depth=far.astype(np.float32))
    assert Segmenter(SkinColourModel.default()).segment(replace(frame, depth=np.zeros_like(frame.depth))) is None
    assert Segmenter(SkinColourModel.default()).segment(empty) is None
    flat = replace(frame, depth=np.full(frame.depth.shape, 0.8, np.float32), colour=None)
    assert Segmenter(None).segment(flat) is None


def test_a_ball_as_large_as_a_head_is_no_hand() -> None:
    camera = Camera(320, 240, 262.0, 262.0, 159.5, 119.5)
    T = np.eye(4)
    T[2, 3] = 0.6
    ball = raycast(camera, np.array([SPHERE]), (T @ sphere(0.0, 0.09))[None], np.array([0]))
    frame = Frame(0, 0.0, ball.depth.astype(np.float32), None, camera)
    assert Segmenter(None).segment(frame) is None


def test_a_lost_hand_is_detected_again() -> None:
    segmenter = Segmenter(SkinColourModel.default())
    frame, mask, _ = made(CLUTTERED, 0)
    assert segmenter.segment(frame) is not None
    gone = replace(frame, depth=np.zeros_like(frame.depth), timestamp=frame.timestamp + 1 / 30)
    assert segmenter.segment(gone) is None
    again = replace(frame, timestamp=frame.timestamp + 2 / 30)
    assert iou(segmenter.segment(again), mask) > 0.9


def test_a_hand_far_from_its_last_position_is_detected_again() -> None:
    """It is outside the window that is searched first."""
    segmenter = Segmenter(SkinColourModel.default())
    frame, mask, _ = made(Synthesis(motion="everyday", sensor="ideal", forearm=False), 0)
    assert segmenter.segment(frame) is not None
    shift = -150
    assert abs(shift) / frame.camera.fx * 0.5 > SegmentationOptions().search.depth_window / 2
    assert frame.colour is not None
    farther = np.where(frame.depth > 0, frame.depth + 0.3, 0).astype(np.float32)
    moved = replace(
        frame,
        timestamp=frame.timestamp + 1 / 30,
        depth=np.roll(farther, shift, axis=1),
        colour=np.roll(frame.colour, shift, axis=1),
    )
    assert iou(segmenter.segment(moved), np.roll(mask, shift, axis=1)) > 0.9


def test_the_visible_part_of_a_hand_at_the_border_is_segmented() -> None:
    frame, mask, _ = made(Synthesis(motion="everyday", sensor="ideal", forearm=False), 0)
    top = int(np.flatnonzero(mask.any(axis=1))[0]) + 50  # through the fingers
    camera = frame.camera.crop(Rect(0, top, frame.camera.width, frame.camera.height))
    assert frame.colour is not None
    cut = replace(frame, depth=frame.depth[top:].copy(), colour=frame.colour[top:].copy(), camera=camera)
    found = Segmenter(SkinColourModel.default()).segment(cut)
    assert iou(found, mask[top:]) > 0.95
    assert found is not None
    assert found.region.top == 0


def test_points_project_to_their_pixels() -> None:
    frame, _, _ = made(CLUTTERED, 0)
    observation = Segmenter(SkinColourModel.default()).segment(frame)
    assert observation is not None
    assert observation.silhouette.shape == observation.depth.shape == observation.camera.shape
    pixels = frame.camera.project(observation.points)
    v, u = np.rint(pixels[:, 1]).astype(int), np.rint(pixels[:, 0]).astype(int)
    np.testing.assert_allclose(pixels, np.stack([u, v], axis=-1), atol=1e-6)
    np.testing.assert_allclose(frame.depth[v, u], observation.points[:, 2])
    # The margin around the hand leaves space for hypotheses.
    rows, columns = (
        np.flatnonzero(observation.silhouette.any(axis=1)),
        np.flatnonzero(observation.silhouette.any(axis=0)),
    )
    room = 0.03 * frame.camera.fx / 0.5
    assert min(rows[0], columns[0]) > room
    assert observation.silhouette.shape[0] - rows[-1] > room


def test_the_wrist_margin_keeps_more_of_the_forearm() -> None:
    frame, _, _ = made(CLUTTERED, 0)
    usual = Segmenter(SkinColourModel.default()).segment(frame)
    more = Segmenter(SkinColourModel.default(), SegmentationOptions(wrist_margin=0.03)).segment(frame)
    assert usual is not None
    assert more is not None
    assert usual.wrist is not None
    assert more.wrist is not None
    np.testing.assert_allclose(more.wrist.point - usual.wrist.point, 0.03 * usual.wrist.normal, atol=1e-9)
    assert more.silhouette.sum() > 1.05 * usual.silhouette.sum()


def test_the_same_frames_give_the_same_masks() -> None:
    def masks() -> list[np.ndarray]:
        segmenter = Segmenter(SkinColourModel.default())
        found = [segmenter.segment(made(CLUTTERED, index)[0]) for index in (0, 2, 4)]
        return [each.silhouette for each in found if each is not None]

    for one, two in zip(masks(), masks(), strict=True):
        np.testing.assert_array_equal(one, two)


def test_a_hand_that_stays_lost_is_located_anew() -> None:
    """The farther of two hands is followed until the tracker has lost it for half a second."""
    made = Synthesiser(Synthesis(frames=1, model="skin"))
    near = made[0].depth.astype(np.float32)
    far = np.roll(np.where(near > 0, near + 0.3, 0), -200, axis=1).astype(np.float32)

    def distances(options: SegmentationOptions, lost: bool) -> list[float]:
        segmenter, found = Segmenter(None, options), list[float]()
        for number in range(12):
            depth = far if number == 0 else np.where(near > 0, near, far)
            observation = segmenter.segment(Frame(number, number / 10, depth, None, made.sensor.camera))
            assert observation is not None
            found.append(float(observation.centre[2]))
            segmenter.set_lost(lost, number / 10)
        return found

    never = SegmentationOptions(search=SearchWindowOptions(lost_lifetime=0))
    assert min(distances(SegmentationOptions(), lost=False)) > 0.7
    assert min(distances(never, lost=True)) > 0.7
    after = distances(SegmentationOptions(), lost=True)
    assert min(after[:6]) > 0.7
    assert max(after[6:]) < 0.6
