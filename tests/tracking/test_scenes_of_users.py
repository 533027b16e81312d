"""Depth alone: tables are never tracked, one of two hands is, and a jump starts anew."""

from collections.abc import Callable

import cv2
import numpy as np
import pytest

from depthtrack.hand.pose import POSITION
from depthtrack.hand.shape import HandShape
from depthtrack.recording.sequence import Frame
from depthtrack.recording.status import Status
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.synthesis.generate import Synthesis, Synthesiser
from depthtrack.tracking.pipeline import Pipeline, TrackedFrame, track_frames
from depthtrack.tracking.registry import create_tracker, tracker_config
from depthtrack.types import Array

FRAMES = 5
Scene = Callable[[int, Array], Array]


@pytest.fixture(scope="module")
def made() -> Synthesiser:
    return Synthesiser(Synthesis(model="skin", frames=12, seed=3))


def tracked(made: Synthesiser, scene: Scene) -> list[TrackedFrame]:
    """Return the frames of a hand whose depth `scene` changes, tracked by `ik`."""
    depths = (scene(index, made[index].depth) for index in range(FRAMES))
    frames = (
        Frame(index, index / 30, np.ascontiguousarray(depth, dtype=np.float32), None, made.sensor.camera)
        for index, depth in enumerate(depths)
    )
    tracker = create_tracker(tracker_config("ik"), HandShape())
    try:
        return list(track_frames(frames, Pipeline(tracker, Segmenter(), HandShape())))
    finally:
        tracker.close()


def errors(made: Synthesiser, found: list[TrackedFrame]) -> list[float]:
    """Return the distance (m) of each trusted palm from the true one of the unchanged hand."""
    poses = [each.estimate.pose for each in found if each.estimate.status.is_trusted]
    truth = [made[each.frame.index].pose for each in found if each.estimate.status.is_trusted]
    return [
        float(np.linalg.norm(p[POSITION] - t[POSITION])) for p, t in zip(poses, truth, strict=True) if p is not None
    ]


@pytest.mark.parametrize("gap", [0.0, 0.01])
def test_a_hand_that_touches_a_table_is_never_tracked_on_it(made: Synthesiser, gap: float) -> None:
    found = tracked(made, lambda _, depth: np.where(depth > 0, depth, depth[depth > 0].max() + gap))
    assert all(error < 0.02 for error in errors(made, found))


@pytest.mark.slow
def test_a_hand_above_a_table_is_tracked(made: Synthesiser) -> None:
    found = tracked(made, lambda _, depth: np.where(depth > 0, depth, depth[depth > 0].max() + 0.03))
    assert [each.estimate.status for each in found] == [Status.STARTED, *[Status.TRACKED] * (FRAMES - 1)]
    assert max(errors(made, found)) < 0.01


@pytest.mark.parametrize("slope", [0.0, 0.25])
def test_a_table_alone_is_absent(made: Synthesiser, slope: float) -> None:
    found = tracked(made, lambda _, depth: 0.5 + slope * np.linspace(1, 0, len(depth))[:, None] + 0 * depth)
    assert [each.estimate.status for each in found] == [Status.ABSENT] * FRAMES


@pytest.mark.parametrize("turns", [1, 2, 3], ids=["portrait", "upside down", "portrait, the other way"])
def test_the_camera_may_be_turned_about_its_axis(made: Synthesiser, turns: int) -> None:
    """The hand comes from another border of the image, and stays at the same depth."""
    camera = made.sensor.camera
    centre = ((camera.width - 1) / 2, (camera.height - 1) / 2)
    turn = cv2.getRotationMatrix2D(centre, 90 * turns, 1.0)

    def turned(_: int, depth: Array) -> Array:
        image = depth.astype(np.float32)
        return cv2.warpAffine(image, turn, (camera.width, camera.height), flags=cv2.INTER_NEAREST).astype(np.float64)

    found = tracked(made, turned)
    assert [each.estimate.status for each in found] == [Status.STARTED, *[Status.TRACKED] * (FRAMES - 1)]
    for each in found:
        truth, pose = made[each.frame.index].pose[POSITION], each.estimate.pose
        assert pose is not None
        expected = turn @ np.append(camera.project(truth), 1)
        np.testing.assert_allclose(camera.project(pose[POSITION]), expected, atol=8)
        assert abs(pose[POSITION][2] - truth[2]) < 0.01


@pytest.mark.parametrize("nearer", [0.12, 0.0], ids=["nearer than the hand", "as near as the hand"])
def test_a_face_is_never_tracked(made: Synthesiser, nearer: float) -> None:
    """A head of 9 cm radius on a body of 40 cm width, beside the hand."""
    camera = made.sensor.camera
    columns, rows = np.meshgrid(np.arange(camera.width), np.arange(camera.height))

    def with_person(_: int, depth: Array) -> Array:
        z = float(np.median(depth[depth > 0])) - nearer
        across, down = (columns - 90) * z / camera.fx, (rows - 130) * z / camera.fy
        head = np.where(np.hypot(across, down * 0.8) < 0.09, z + 0.09 - np.sqrt(np.maximum(0.0081 - across**2, 0)), 0)
        body = np.where((down > 0.12) & (np.abs(across + 0.05) < 0.15), z + 0.05 + across**2, 0)
        person = np.where(head > 0, head, body)
        both = (depth > 0) & (person > 0)
        return np.where(both, np.minimum(depth, person), np.maximum(depth, person))

    found = errors(made, tracked(made, with_person))
    assert len(found) == FRAMES
    assert max(found) < 0.01


@pytest.mark.slow
def test_one_of_two_hands_is_followed(made: Synthesiser) -> None:
    def with_another(_: int, depth: Array) -> Array:
        other = np.roll(depth[:, ::-1], -220, axis=1)
        return np.where(depth > 0, depth, np.where(other > 0, other + 0.05, 0))

    found = tracked(made, with_another)
    assert [each.estimate.status for each in found] == [Status.STARTED, *[Status.TRACKED] * (FRAMES - 1)]
    assert max(errors(made, found)) < 0.01


@pytest.mark.slow
def test_a_jump_is_lost_and_starts_anew(made: Synthesiser) -> None:
    found = tracked(made, lambda index, depth: depth if index < 2 else np.roll(depth, 260, axis=1))
    statuses = [each.estimate.status for each in found]
    assert statuses == [Status.STARTED, Status.TRACKED, Status.LOST, Status.STARTED, Status.TRACKED]
    camera = made.sensor.camera
    last, pose = made[FRAMES - 1].pose, found[-1].estimate.pose
    assert pose is not None
    moved = camera.project(pose[POSITION]) - camera.project(last[POSITION])
    np.testing.assert_allclose(moved, [260, 0], atol=25)
