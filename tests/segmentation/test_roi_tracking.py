"""Segmentation near a prior: reach, wrist, skin, and the change to the search."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.geometry.camera import Camera
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.recording.sequence import Frame
from depthtrack.segmentation.continuing_surfaces import BEYOND_WRIST, OUTSIDE, READING
from depthtrack.segmentation.hand_size import HandSize
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.segmentation.roi_tracking import RoiPrior, mark_reachable, segment_roi
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.segmentation.skin_adaptation import AdaptiveSkin
from depthtrack.segmentation.skin_colour import SkinColourModel
from depthtrack.segmentation.wrist import WristPlane
from depthtrack.synthesis.generate import Synthesis, Synthesiser

MODEL = HandModel(HandShape())
OPTIONS = SegmentationOptions()
HAND = HandSize(0.0145, 0.046, 0.16)


@pytest.fixture(scope="module")
def made() -> Synthesiser:
    return Synthesiser(Synthesis(sensor="kinect1", background="room", model="skin", seed=4))


def frame_of(made: Synthesiser, index: int) -> Frame:
    """Return a synthetic frame as a recording has it."""
    frame = made[index]
    return Frame(index, frame.timestamp, frame.depth.astype(np.float32), frame.colour, made.sensor.camera)


def prior_of(made: Synthesiser, index: int, error: float = 0.0) -> RoiPrior:
    """Return the prior by the true pose of frame `index`, moved by `error` metres."""
    pose = made.poses[index].copy()
    pose[:3] += error
    wrist = MODEL.joints(pose)[0]
    axis = wrist - pose[:3]
    return RoiPrior(pose[:3], WristPlane(wrist, axis / np.linalg.norm(axis)), HAND)


@pytest.mark.parametrize("index", [0, 120, 257, 320, 345])
def test_the_hand_is_segmented_near_its_prior(made: Synthesiser, index: int) -> None:
    """One of the frames shows the hand edge-on, where a search fails."""
    skin = AdaptiveSkin(SkinColourModel.default())
    found = segment_roi(frame_of(made, index), prior_of(made, index, error=0.004), skin, OPTIONS)
    assert found is not None
    mask = np.zeros(made.sensor.camera.shape, np.bool_)
    mask[found.region.slices] = found.silhouette
    truth = made[index].mask
    assert np.sum(mask & truth) / np.sum(mask | truth) > 0.85
    assert not np.any(found.readings & ~found.silhouette)
    assert found.silhouette.shape == found.region.shape


def test_the_margin_keeps_forearm_beyond_the_wrist(made: Synthesiser) -> None:
    skin, prior = AdaptiveSkin(SkinColourModel.default()), prior_of(made, 0)
    farthest = []
    for margin in (0.0, 0.03):
        found = segment_roi(frame_of(made, 0), prior, skin, replace(OPTIONS, wrist_margin=margin))
        assert found is not None
        v, u = np.nonzero(found.readings)
        depth = made[0].depth[found.region.slices][v, u]
        points = made.sensor.camera.crop(found.region).unproject(np.column_stack([u, v]), depth)
        farthest.append(((points - prior.wrist.point) @ prior.wrist.normal).max())
    assert farthest[0] < 0.002
    assert farthest[1] == pytest.approx(0.03, abs=0.003)


@given(seed=st.integers(0, 2**32 - 1))
def test_reach_kernel_equals_the_definition(seed: int) -> None:
    rng = np.random.default_rng(seed)
    camera = Camera(23, 17, 40.0, 38.0, 11.0, 8.0)
    depth = np.where(rng.random(camera.shape) < 0.3, 0, rng.uniform(0.3, 0.7, camera.shape)).astype(np.float32)
    centre, wrist, axis = (
        rng.normal(size=3) * 0.05 + [0, 0, 0.5],
        rng.normal(size=3) * 0.05 + [0, 0, 0.5],
        rng.normal(size=3),
    )
    kinds = np.empty(camera.shape, np.uint8)
    mark_reachable(depth, (camera.fx, camera.fy, camera.cx, camera.cy), centre, 0.15, wrist, axis, kinds)
    v, u = np.mgrid[: camera.height, : camera.width]
    points = camera.unproject(np.stack([u, v], axis=-1), np.where(depth > 0, depth, centre[2]))
    near, before = np.linalg.norm(points - centre, axis=-1) < 0.15, (points - wrist) @ axis < 0
    np.testing.assert_array_equal(kinds == OUTSIDE, ~near)
    np.testing.assert_array_equal(kinds == BEYOND_WRIST, near & ~before)
    np.testing.assert_array_equal(kinds == READING, near & before & (depth > 0))


def test_a_prior_without_readings_gives_no_hand(made: Synthesiser) -> None:
    camera = made.sensor.camera
    empty = Frame(0, 0.0, np.zeros(camera.shape, np.float32), None, camera)
    assert segment_roi(empty, prior_of(made, 0), None, OPTIONS) is None
    behind = RoiPrior(np.array([0, 0, -0.5]), prior_of(made, 0).wrist, HAND)
    assert segment_roi(frame_of(made, 0), behind, None, OPTIONS) is None


def test_a_segmenter_searches_if_the_prior_is_wrong(made: Synthesiser) -> None:
    segmenter = Segmenter(SkinColourModel.default())
    nowhere = RoiPrior(np.array([-0.2, -0.15, 0.3]), prior_of(made, 0).wrist, HandSize(0.0145, 0.046, 0.02))
    found = segmenter.segment(frame_of(made, 0), nowhere)
    assert found is not None
    assert np.linalg.norm(found.centre - made.poses[0][:3]) < 0.06


def test_a_search_continues_from_the_last_prior(made: Synthesiser) -> None:
    """After guided frames, the search is about as accurate as a search in all frames."""
    ious = {}
    for guided in (True, False):
        segmenter = Segmenter(SkinColourModel.default())
        for index in range(100, 108):
            found = segmenter.segment(frame_of(made, index), prior_of(made, index) if guided and index < 107 else None)
        assert found is not None
        assert (found.arm_direction is None) == (found.wrist is None)
        mask = np.zeros(made.sensor.camera.shape, np.bool_)
        mask[found.region.slices] = found.silhouette
        truth = made[107].mask
        ious[guided] = np.sum(mask & truth) / np.sum(mask | truth)
    assert ious[True] > max(0.9, ious[False] - 0.02)


def test_sizes_are_those_of_the_last_prior(made: Synthesiser) -> None:
    """The centre is half a palm behind the surface; a reset restores the average palm."""
    thick, frame = HandSize(0.03, 0.046, 0.16), frame_of(made, 0)
    prior = prior_of(made, 0)

    def depth_after(segmenter: Segmenter) -> float:
        found = segmenter.segment(frame)
        assert found is not None
        return float(np.linalg.norm(found.centre))

    guided = Segmenter(SkinColourModel.default())
    guided.segment(frame, RoiPrior(prior.centre, prior.wrist, HAND))
    usual = depth_after(guided)
    guided.reset()
    guided.segment(frame, RoiPrior(prior.centre, prior.wrist, thick))
    assert depth_after(guided) == pytest.approx(usual + 0.03 - 0.0145, abs=0.003)
    guided.reset()
    assert depth_after(guided) == depth_after(Segmenter(SkinColourModel.default()))
