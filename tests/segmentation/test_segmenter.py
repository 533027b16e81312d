"""Segmentation on synthetic frames: the hand against its true silhouette, the wrist, what is no hand, and borders."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.hand.primitives import SPHERE, sphere
from depthtrack.recording.sequence import Frame
from depthtrack.rendering.raycast import raycast
from depthtrack.segmentation.grid import MAX_JUMP
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.pixel_labels import (
    ARM,
    BESIDE,
    ELSEWHERE,
    HAND,
    MISSING,
    NOTHING,
    OTHER,
    READING,
    sort_pixels,
)
from depthtrack.segmentation.segmenter import DEPTH_WINDOW, HandLocator, Segmentation
from depthtrack.segmentation.skin_colour import SkinColourModel
from depthtrack.synthesis.generate import Synthesis, Synthesiser

Mask = np.ndarray
CLUTTERED = Synthesis(motion="everyday", sensor="kinect1", background="room", model="skin", seed=22)


@cache
def made(options: Synthesis, index: int) -> tuple[Frame, Mask, np.ndarray]:
    """A frame, the hand's true silhouette, and the wrist (3,)."""
    synthesiser = _synthesiser(options)
    frame = synthesiser[index]
    depth = frame.depth.astype(np.float32)
    return Frame(index, frame.timestamp, depth, frame.colour, synthesiser.sensor.camera), frame.mask, frame.joints[0]


@cache
def _synthesiser(options: Synthesis) -> Synthesiser:
    return Synthesiser(options)


def without_colour(frame: Frame) -> Frame:
    return replace(frame, colour=None)


def overlap(found: Segmentation | None, mask: Mask) -> float:
    if found is None:
        return 0.0
    whole = np.zeros_like(mask)
    whole[found.region.slices] = found.skin
    return float(np.sum(whole & mask) / np.sum(whole | mask))


def test_a_hand_with_forearm_in_a_cluttered_room() -> None:
    """A bookshelf of skin's colour right behind, a face beside: a sequence followed from its first frame."""
    segmenter = HandLocator(SkinColourModel.default())
    overlaps, wrists = [], []
    for index in range(0, 40, 2):
        frame, mask, wrist = made(CLUTTERED, index)
        found = segmenter.locate(frame)
        overlaps.append(overlap(found, mask))
        assert found is not None
        assert found.wrist is not None
        wrists.append((wrist - found.wrist.point) @ found.wrist.normal)
    assert np.mean(overlaps) > 0.95
    assert np.abs(wrists).max() < 0.015


@pytest.mark.parametrize("sensor", ["kinect1", "kinect2", "realsense"])
def test_every_frame_may_be_the_first(sensor: str) -> None:
    options = Synthesis(motion="signs", sensor=sensor, background="room", seed=3)  # type: ignore[arg-type]
    for index in (0, 60, 150):
        frame, mask, _ = made(options, index)
        assert overlap(HandLocator(SkinColourModel.default()).locate(frame), mask) > 0.8
        assert overlap(HandLocator(None).locate(frame), mask) > 0.75


def test_a_ring_of_fingers_is_seen_through() -> None:
    """Thumb and index touch, and the shelf behind them has the colour of skin."""
    segmenter = HandLocator(SkinColourModel.default())
    for index in range(284, 296, 2):
        frame, mask, _ = made(CLUTTERED, index)
        found = segmenter.locate(frame)
    assert found is not None
    whole = np.zeros_like(mask)
    whole[found.region.slices] = found.skin
    behind = ~mask & (frame.depth > 1.0)
    assert np.sum(whole & behind) < 0.01 * np.sum(mask)


@pytest.mark.parametrize("model", ["skin", "primitives"])
def test_hands_of_both_kinds_are_cut_at_the_same_wrist(model: str) -> None:
    options = replace(CLUTTERED, model=model)  # type: ignore[arg-type]
    segmenter = HandLocator(SkinColourModel.default())
    overlaps = []
    for index in range(200, 240, 4):
        frame, mask, _ = made(options, index)
        overlaps.append(overlap(segmenter.locate(frame), mask))
    assert np.mean(overlaps) > 0.94


def test_depth_alone_follows_the_hand() -> None:
    segmenter = HandLocator(None)
    for index in range(0, 20, 2):
        frame, mask, _ = made(CLUTTERED, index)
        assert overlap(segmenter.locate(without_colour(frame)), mask) > 0.85


def test_a_hand_without_an_arm_is_not_cut() -> None:
    frame, mask, _ = made(Synthesis(motion="everyday", sensor="ideal", forearm=False), 0)
    found = HandLocator(SkinColourModel.default()).locate(frame)
    assert found is not None
    assert found.wrist is None
    assert found.arm_direction is None
    assert overlap(found, mask) > 0.97


def test_the_arm_points_from_hand_to_forearm() -> None:
    frame, _, wrist = made(CLUTTERED, 0)
    found = HandLocator(SkinColourModel.default()).locate(frame)
    assert found is not None
    assert found.arm_direction is not None
    along = wrist - found.centre
    assert along @ found.arm_direction > 0.9 * np.linalg.norm(along)
    assert np.linalg.norm(along) == pytest.approx(0.06, abs=0.03)


def test_an_empty_room_has_no_hand() -> None:
    frame, _, _ = made(CLUTTERED, 0)
    # Beyond a metre there are the bookshelf, of skin's colour, the table, and a bystander with a face.
    far = frame.depth * (frame.depth > 1.0)
    empty = replace(frame, depth=far.astype(np.float32))
    assert HandLocator(SkinColourModel.default()).locate(replace(frame, depth=np.zeros_like(frame.depth))) is None
    assert HandLocator(SkinColourModel.default()).locate(empty) is None
    flat = replace(frame, depth=np.full(frame.depth.shape, 0.8, np.float32), colour=None)
    assert HandLocator(None).locate(flat) is None


def test_a_ball_as_large_as_a_head_is_no_hand() -> None:
    camera = Camera(320, 240, 262.0, 262.0, 159.5, 119.5)
    T = np.eye(4)
    T[2, 3] = 0.6
    ball = raycast(camera, np.array([SPHERE]), (T @ sphere(0.0, 0.09))[None], np.array([0]))
    frame = Frame(0, 0.0, ball.depth.astype(np.float32), None, camera)
    assert HandLocator(None).locate(frame) is None


def test_a_hand_lost_is_found_again() -> None:
    segmenter = HandLocator(SkinColourModel.default())
    frame, mask, _ = made(CLUTTERED, 0)
    assert segmenter.locate(frame) is not None
    gone = replace(frame, depth=np.zeros_like(frame.depth), timestamp=frame.timestamp + 1 / 30)
    assert segmenter.locate(gone) is None
    again = replace(frame, timestamp=frame.timestamp + 2 / 30)
    assert overlap(segmenter.locate(again), mask) > 0.9


def test_a_hand_far_from_its_last_place_is_found_again() -> None:
    """Farther than the window that is searched first."""
    segmenter = HandLocator(SkinColourModel.default())
    frame, mask, _ = made(Synthesis(motion="everyday", sensor="ideal", forearm=False), 0)
    assert segmenter.locate(frame) is not None
    shift = -150
    assert abs(shift) / frame.camera.fx * 0.5 > DEPTH_WINDOW / 2
    assert frame.colour is not None
    farther = np.where(frame.depth > 0, frame.depth + 0.3, 0).astype(np.float32)
    moved = replace(
        frame,
        timestamp=frame.timestamp + 1 / 30,
        depth=np.roll(farther, shift, axis=1),
        colour=np.roll(frame.colour, shift, axis=1),
    )
    assert overlap(segmenter.locate(moved), np.roll(mask, shift, axis=1)) > 0.9


def test_a_hand_at_the_border_is_found_as_far_as_it_is_seen() -> None:
    frame, mask, _ = made(Synthesis(motion="everyday", sensor="ideal", forearm=False), 0)
    top = int(np.flatnonzero(mask.any(axis=1))[0]) + 50  # through the fingers
    camera = frame.camera.crop(Rect(0, top, frame.camera.width, frame.camera.height))
    assert frame.colour is not None
    cut = replace(frame, depth=frame.depth[top:].copy(), colour=frame.colour[top:].copy(), camera=camera)
    found = HandLocator(SkinColourModel.default()).locate(cut)
    assert overlap(found, mask[top:]) > 0.95
    assert found is not None
    assert found.region.top == 0


def test_observations_lie_where_the_frame_saw_them() -> None:
    frame, _, _ = made(CLUTTERED, 0)
    found = HandLocator(SkinColourModel.default()).locate(frame)
    assert found is not None
    observation = Observation.of(frame, found)
    assert observation.silhouette.shape == observation.depth.shape == observation.camera.shape
    pixels = frame.camera.project(observation.points)
    v, u = np.rint(pixels[:, 1]).astype(int), np.rint(pixels[:, 0]).astype(int)
    np.testing.assert_allclose(pixels, np.stack([u, v], axis=-1), atol=1e-6)
    np.testing.assert_allclose(frame.depth[v, u], observation.points[:, 2])
    # There is room around the hand for hypotheses.
    rows, columns = (
        np.flatnonzero(observation.silhouette.any(axis=1)),
        np.flatnonzero(observation.silhouette.any(axis=0)),
    )
    room = 0.03 * frame.camera.fx / 0.5
    assert min(rows[0], columns[0]) > room
    assert observation.silhouette.shape[0] - rows[-1] > room


def test_more_of_the_forearm_is_kept_on_demand() -> None:
    frame, _, _ = made(CLUTTERED, 0)
    usual = HandLocator(SkinColourModel.default()).locate(frame)
    more = HandLocator(SkinColourModel.default(), wrist_margin=0.03).locate(frame)
    assert usual is not None
    assert more is not None
    assert usual.wrist is not None
    assert more.wrist is not None
    np.testing.assert_allclose(more.wrist.point - usual.wrist.point, 0.03 * usual.wrist.normal, atol=1e-9)
    assert more.skin.sum() > 1.05 * usual.skin.sum()


def test_the_same_frames_give_the_same_masks() -> None:
    def masks() -> list[np.ndarray]:
        segmenter = HandLocator(SkinColourModel.default())
        found = [segmenter.locate(made(CLUTTERED, index)[0]) for index in (0, 2, 4)]
        return [each.skin for each in found if each is not None]

    for one, two in zip(masks(), masks(), strict=True):
        np.testing.assert_array_equal(one, two)


def slow_kind(
    z: float,
    pixel: tuple[int, int],
    camera: Camera,
    nodes: np.ndarray,
    labels: np.ndarray,
    stride: int,
    plane: np.ndarray,
) -> int:
    """What `sort_pixels` says of one pixel, in plain words."""
    u, v = pixel
    i, j = v // stride, u // stride
    around = [
        (k, m)
        for k in range(max(i - 1, 0), min(i + 2, labels.shape[0]))
        for m in range(max(j - 1, 0), min(j + 2, labels.shape[1]))
        if labels[k, m] != ELSEWHERE and (z == 0 or abs(nodes[k, m] - np.float32(z)) < np.float32(MAX_JUMP))
    ]
    if not around:
        return NOTHING
    guide_confidence = [node for node in around if labels[node] != BESIDE]
    if not guide_confidence:
        return OTHER if z > 0 else NOTHING
    if z > 0:
        best = min(guide_confidence, key=lambda node: abs(nodes[node] - np.float32(z)))
    else:
        best = min(guide_confidence, key=lambda node: (node[0] - i) ** 2 + (node[1] - j) ** 2)
    hand = labels[best] == HAND
    if {HAND, ARM} <= {int(labels[node]) for node in around}:
        point = camera.unproject((u, v), z if z > 0 else float(nodes[best]))
        hand = bool(point @ plane[:3] <= plane[3])
    return (READING if hand else OTHER) if z > 0 else (MISSING if hand else NOTHING)


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1))
def test_pixels_are_sorted_as_described(seed: int) -> None:
    rng = np.random.default_rng(seed)
    camera, stride = Camera(24, 20, 40.0, 41.0, 11.0, 9.0), 4
    nodes = rng.uniform(0.5, 0.58, (5, 6)).astype(np.float32)
    labels = rng.choice([ELSEWHERE, HAND, HAND, ARM, BESIDE], (5, 6)).astype(np.uint8)
    nodes[labels == ELSEWHERE] = 0
    depth = np.where(rng.random(camera.shape) < 0.3, 0, rng.uniform(0.5, 0.6, camera.shape)).astype(np.float32)
    plane = np.append(rng.normal(size=3), 0.05)
    blocks = Rect(1, 1, 6, 4)
    roi = Rect(4, 4, 24, 16)
    lens = (camera.fx, camera.fy, camera.cx, camera.cy)
    out = np.empty((roi.height, roi.width), np.uint8)
    sort_pixels(depth, tuple(roi), nodes, labels, tuple(blocks), stride, lens, tuple(plane.tolist()), out)
    expected = [
        [
            slow_kind(float(depth[v, u]), (u, v), camera, nodes, labels, stride, plane)
            for u in range(roi.left, roi.right)
        ]
        for v in range(roi.top, roi.bottom)
    ]
    np.testing.assert_array_equal(out, expected)
