"""Surfaces that continue beyond the hand's reach are no part of it."""

from contextlib import closing

import numpy as np
import pytest

from depthtrack.evaluation.metrics import silhouette_iou
from depthtrack.recording.sequence import Frame
from depthtrack.recording.status import Status
from depthtrack.segmentation.continuing_surfaces import MISSING, OUTSIDE, READING, without_continuing_surfaces
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.synthesis.generate import Synthesis, Synthesiser
from depthtrack.tracking.pipeline import Pipeline
from depthtrack.tracking.registry import create_tracker, tracker_config


def test_a_surface_that_goes_on_outside_is_removed_and_an_island_kept() -> None:
    depth = np.full((60, 60), 0.6, dtype=np.float32)
    depth[20:40, 20:40] = 0.5
    v, u = np.indices(depth.shape)
    reached = (v - 30) ** 2 + (u - 30) ** 2 < 20**2
    kinds = np.where(reached, READING, OUTSIDE).astype(np.uint8)
    kept = without_continuing_surfaces(depth, kinds, kinds == READING, 200.0, 0.03, 0.5)
    np.testing.assert_array_equal(kept, depth == np.float32(0.5))


def test_readings_without_a_continuation_are_returned_as_they_are() -> None:
    depth = np.zeros((30, 30), dtype=np.float32)
    depth[5:20, 5:20] = 0.5
    kinds = np.where(depth > 0, READING, MISSING).astype(np.uint8)
    readings = kinds == READING
    assert without_continuing_surfaces(depth, kinds, readings, 200.0, 0.03, 0.5) is readings


@pytest.mark.slow
@pytest.mark.parametrize("sensor", ["ideal", "kinect1", "kinect2"])
@pytest.mark.parametrize("behind", [0.06, 0.1, 0.2])
def test_a_wall_behind_the_hand_is_cut_off_from_depth_alone(sensor: str, behind: float) -> None:
    made = Synthesiser(Synthesis(motion="everyday", model="skin", sensor=sensor, forearm=True, frames=13))  # type: ignore[arg-type]
    wall, hand, overlaps, statuses = np.float32(made.distance + behind), made.options.hand, [], []
    with closing(create_tracker(tracker_config("ik"), hand)) as tracker:
        pipeline = Pipeline(tracker, Segmenter(None), hand)
        for index in range(0, 13, 3):
            shown = made[index]
            depth = shown.depth.astype(np.float32)
            depth[(shown.exact_depth == 0) | (shown.exact_depth > wall)] = wall
            each = pipeline.step(Frame(index, shown.timestamp, depth, None, made.sensor.camera))
            assert each.observation is not None
            overlaps.append(silhouette_iou(each.observation.whole_mask(depth.shape), shown.mask))
            statuses.append(each.estimate.status)
    assert statuses == [Status.STARTED, *[Status.TRACKED] * 4]
    assert min(overlaps) > 0.9
