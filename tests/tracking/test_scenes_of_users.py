"""Depth alone: tables are never tracked, one of two hands is, and a jump starts anew."""

from collections.abc import Callable

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


@pytest.mark.slow
def test_one_of_two_hands_is_followed(made: Synthesiser) -> None:
    def with_another(_: int, depth: Array) -> Array:
        other = np.roll(depth[:, ::-1], -220, axis=1)
        return np.where(depth > 0, depth, np.where(other > 0, other + 0.05, 0))

    found = tracked(made, with_another)
    assert [each.estimate.status for each in found] == [Status.STARTED, *[Status.TRACKED] * (FRAMES - 1)]
    assert max(errors(made, found)) < 0.01


@pytest.mark.slow
def test_a_jump_starts_anew(made: Synthesiser) -> None:
    found = tracked(made, lambda index, depth: depth if index < 2 else np.roll(depth, 260, axis=1))
    statuses = [each.estimate.status for each in found]
    assert Status.TRACKED not in statuses[2:3]
    assert Status.STARTED in statuses[2:]
    camera = made.sensor.camera
    last, pose = made[FRAMES - 1].pose, found[-1].estimate.pose
    assert pose is not None
    moved = camera.project(pose[POSITION]) - camera.project(last[POSITION])
    np.testing.assert_allclose(moved, [260, 0], atol=25)
