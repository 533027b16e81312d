"""Segmentation where a tracker expects the hand: reach, wrist, skin, and what to do without readings."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.geometry.camera import Camera
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.recording.sequence import Frame
from depthtrack.segmentation.roi_tracking import READING, RoiPrior, mark_reachable, segment_roi
from depthtrack.segmentation.segmenter import HandLocator
from depthtrack.segmentation.skin_adaptation import AdaptiveSkin
from depthtrack.segmentation.skin_colour import SkinColourModel
from depthtrack.segmentation.wrist import WristPlane
from depthtrack.synthesis.generate import Synthesis, Synthesiser

MODEL = HandModel(HandShape())


@pytest.fixture(scope="module")
def made() -> Synthesiser:
    return Synthesiser(Synthesis(sensor="kinect1", background="room", model="skin", seed=4))


def frame_of(made: Synthesiser, index: int) -> Frame:
    frame = made[index]
    return Frame(index, frame.timestamp, frame.depth.astype(np.float32), frame.colour, made.sensor.camera)


def place_of(made: Synthesiser, index: int, error: float = 0.0) -> RoiPrior:
    """The true place of frame `index`, moved by `error` metres."""
    pose = made.poses[index].copy()
    pose[:3] += error
    wrist = MODEL.joints(pose)[0]
    axis = wrist - pose[:3]
    return RoiPrior(pose[:3], 0.19, WristPlane(wrist, axis / np.linalg.norm(axis)))


@pytest.mark.parametrize("index", [0, 120, 257, 320, 345])
def test_cuts_out_the_hand_where_it_is_expected(made: Synthesiser, index: int) -> None:
    """Among them a hand that shows its edge, which a search loses."""
    found = segment_roi(
        frame_of(made, index), place_of(made, index, error=0.004), AdaptiveSkin(SkinColourModel.default())
    )
    assert found is not None
    mask = np.zeros(made.sensor.camera.shape, np.bool_)
    mask[found.region.slices] = found.skin
    truth = made[index].mask
    assert np.sum(mask & truth) / np.sum(mask | truth) > 0.85
    assert not np.any(found.readings & ~found.skin)
    assert found.skin.shape == found.region.shape


@given(seed=st.integers(0, 2**32 - 1))
def test_reach_kernel_equals_plain_geometry(seed: int) -> None:
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
    near = (np.linalg.norm(points - centre, axis=-1) < 0.15) & ((points - wrist) @ axis < 0)
    np.testing.assert_array_equal(kinds > 0, near)
    np.testing.assert_array_equal(kinds == READING, near & (depth > 0))


def test_nothing_expected_is_there(made: Synthesiser) -> None:
    camera = made.sensor.camera
    empty = Frame(0, 0.0, np.zeros(camera.shape, np.float32), None, camera)
    assert segment_roi(empty, place_of(made, 0), None) is None
    behind = RoiPrior(np.array([0, 0, -0.5]), 0.2, place_of(made, 0).wrist)
    assert segment_roi(frame_of(made, 0), behind, None) is None


def test_a_segmenter_searches_where_the_guide_was_wrong(made: Synthesiser) -> None:
    segmenter = HandLocator(SkinColourModel.default())
    nowhere = RoiPrior(np.array([-0.2, -0.15, 0.3]), 0.05, place_of(made, 0).wrist)
    found = segmenter.locate(frame_of(made, 0), nowhere)
    assert found is not None
    assert np.linalg.norm(found.centre - made.poses[0][:3]) < 0.06


def test_a_segmenter_goes_on_from_where_it_was_guided(made: Synthesiser) -> None:
    """Guided for a few frames and then left alone, it cuts about as well as one that was alone all the time."""
    overlaps = {}
    for guided in (True, False):
        segmenter = HandLocator(SkinColourModel.default())
        for index in range(100, 108):
            found = segmenter.locate(frame_of(made, index), place_of(made, index) if guided and index < 107 else None)
        assert found is not None
        assert (found.arm_direction is None) == (found.wrist is None)
        mask = np.zeros(made.sensor.camera.shape, np.bool_)
        mask[found.region.slices] = found.skin
        truth = made[107].mask
        overlaps[guided] = np.sum(mask & truth) / np.sum(mask | truth)
    assert overlaps[True] > max(0.9, overlaps[False] - 0.02)
