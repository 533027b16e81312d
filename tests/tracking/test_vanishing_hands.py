"""Frames whose hand leaves, is covered or is replaced end no run."""

from collections.abc import Callable, Iterator
from contextlib import closing

import numpy as np
import pytest

from depthtrack.hand.shape import HandShape
from depthtrack.recording.sequence import Frame
from depthtrack.recording.status import Status
from depthtrack.segmentation import hand_locator
from depthtrack.segmentation import segmenter as segmentation
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.segmentation.skin_colour import SkinColourModel
from depthtrack.synthesis.generate import Synthesis, Synthesiser
from depthtrack.tracking.pipeline import Pipeline, TrackedFrame
from depthtrack.tracking.registry import create_tracker, tracker_config

Change = Callable[[np.ndarray, np.ndarray, np.ndarray, int], None]
"""Changes depth (h, w), m, and colour (h, w, 3) in place; mask (h, w) of the hand, and number of the frame."""
SKIN = (200, 150, 120)


@pytest.fixture(scope="module")
def made() -> Synthesiser:
    return Synthesiser(Synthesis(motion="everyday", sensor="kinect1", background="room", model="skin", frames=9))


def leaves(depth: np.ndarray, colour: np.ndarray, mask: np.ndarray, number: int) -> None:
    shift = 80 * number
    for image in (depth, colour):
        image[:, shift:] = image[:, : image.shape[1] - shift].copy()
        image[:, :shift] = 0


def is_covered(depth: np.ndarray, colour: np.ndarray, mask: np.ndarray, number: int) -> None:
    depth[mask], colour[mask] = 0.4, (30, 60, 160)


def gives_way_to_skin(depth: np.ndarray, colour: np.ndarray, mask: np.ndarray, number: int) -> None:
    rows, columns = np.nonzero(mask)
    v, u = np.indices(depth.shape)
    disc = (v - rows.mean()) ** 2 + (u - columns.mean()) ** 2 < (10 * number) ** 2
    depth[mask] = 2.0
    depth[disc], colour[disc] = 0.5, SKIN


def fills_the_image(depth: np.ndarray, colour: np.ndarray, mask: np.ndarray, number: int) -> None:
    depth[:], colour[:] = 0.45, SKIN


def has_no_reading(depth: np.ndarray, colour: np.ndarray, mask: np.ndarray, number: int) -> None:
    depth[:] = 0


def is_a_few_pixels(depth: np.ndarray, colour: np.ndarray, mask: np.ndarray, number: int) -> None:
    rest = mask & (np.indices(depth.shape).sum(axis=0) % 23 > 0)
    depth[rest] = 0


CHANGES = (leaves, is_covered, gives_way_to_skin, fills_the_image, has_no_reading, is_a_few_pixels)


def changed(made: Synthesiser, change: Change, with_colour: bool) -> Iterator[Frame]:
    """Yield two frames as they are, five changed ones, and two as they are."""
    for index in range(9):
        frame = made[index]
        depth, colour = frame.depth.astype(np.float32), frame.colour.copy()
        if 2 <= index < 7:
            change(depth, colour, frame.mask, index - 1)
        yield Frame(index, frame.timestamp, depth, colour if with_colour else None, made.sensor.camera)


def track(made: Synthesiser, change: Change, with_colour: bool) -> list[TrackedFrame]:
    segmenter = Segmenter(SkinColourModel.default() if with_colour else None)
    with closing(create_tracker(tracker_config("ik"), HandShape())) as tracker:
        pipeline = Pipeline(tracker, segmenter, HandShape(), made.poses[0])
        return [pipeline.step(frame) for frame in changed(made, change, with_colour)]


@pytest.mark.slow
@pytest.mark.parametrize("with_colour", [True, False])
@pytest.mark.parametrize("change", CHANGES)
def test_no_frame_ends_the_run(made: Synthesiser, change: Change, with_colour: bool) -> None:
    tracked = track(made, change, with_colour)
    assert len(tracked) == 9
    for each in tracked:
        assert (each.observation is None) == (each.estimate.status is Status.ABSENT)
        assert each.estimate.pose is None or np.isfinite(each.estimate.pose).all()
    if change is has_no_reading:
        assert [each.estimate.status for each in tracked[2:7]] == [Status.ABSENT] * 5


def test_a_hand_that_counts_as_forearm_is_absent(made: Synthesiser, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every node of the hand is labelled as arm."""
    monkeypatch.setattr(hand_locator, "arm_nodes", lambda grid, *_: np.ones(grid.depth.shape, dtype=np.bool_))
    segmenter = Segmenter(None)
    frame = made[0]
    assert segmenter.segment(Frame(0, 0.0, frame.depth.astype(np.float32), None, made.sensor.camera)) is None


def test_a_hand_of_flying_pixels_is_absent(made: Synthesiser, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every reading is a flying pixel."""
    frame, segmenter = made[0], Segmenter(None)
    depth_only = Frame(0, 0.0, frame.depth.astype(np.float32), None, made.sensor.camera)
    assert segmenter.segment(depth_only) is not None
    monkeypatch.setattr(segmentation, "flying_pixels", lambda depth, *_: np.ones(depth.shape, dtype=np.bool_))
    assert segmenter.segment(depth_only) is None
