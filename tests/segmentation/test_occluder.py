"""With colour, an object in the hand is an occluder; a bare hand has none."""

from dataclasses import replace

import numpy as np
import pytest

from depthtrack.hand.kinematics import HandModel
from depthtrack.recording.sequence import Frame
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.occluder import solid_depth
from depthtrack.segmentation.options import OccluderOptions, SegmentationOptions
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.segmentation.skin_colour import SkinColourModel
from depthtrack.synthesis.generate import Synthesis, Synthesiser
from depthtrack.tracking.guided_segmentation import roi_prior
from depthtrack.types import Mask

HOLDING = Synthesis("everyday", frames=3, model="skin", sensor="kinect1", background="room", held_object="sphere")


def observed(recording: Synthesis, index: int, guided: bool, enabled: bool = True) -> tuple[Observation, Mask]:
    """Return the observation of a frame, and the mask of its sphere in the region of interest."""
    made = Synthesiser(recording)
    frame, options = made[index], SegmentationOptions(occluder=OccluderOptions(enabled))
    segmenter = Segmenter(SkinColourModel.default(options.skin_colour.prior), options)
    prior = roi_prior(HandModel(recording.hand), frame.pose) if guided else None
    colour = frame.colour
    found = segmenter.segment(Frame(index, 0.0, frame.depth.astype(np.float32), colour, made.sensor.camera), prior)
    assert found is not None
    near = np.abs(frame.exact_depth - made.distance) < 0.15
    return found, found.region.crop(near & ~frame.mask & ~frame.skin)


@pytest.mark.parametrize("guided", [True, False])
def test_a_sphere_in_the_hand_is_an_occluder(guided: bool) -> None:
    found, sphere = observed(HOLDING, 2, guided)
    assert found.occluder is not None
    there = found.occluder > 0
    # A band along the hand's outline, where depth is least reliable, counts as hand.
    assert (there & sphere).sum() > 0.5 * sphere.sum()
    assert (there & sphere).sum() > 0.9 * there.sum()
    assert not (there & (found.silhouette | (found.depth > 0))).any()


@pytest.mark.parametrize(("bulge", "expected"), [(0.02, 0.02), (0.0, 0.0), (-0.02, 0.0)])
def test_an_object_is_solid_up_to_the_plane_of_its_outline(bulge: float, expected: float) -> None:
    radius = 40
    v, u = np.mgrid[:150, :200]
    away = np.hypot(u - 110, v - 70) / radius
    part = away < 1
    # A slanted plane, and a cap before or behind it.
    plane = 0.5 / (1 + 0.001 * (u - 110))
    depth = (plane - bulge * np.sqrt(np.clip(1 - away**2, 0, 1))).astype(np.float32)
    solid = solid_depth(depth, part, 0.001)
    assert (solid - depth)[70, 110] == pytest.approx(expected, abs=5e-3)
    assert np.all(solid >= depth)


def test_an_object_is_no_deeper_than_a_ball_of_its_area() -> None:
    depth = np.full((60, 60), 0.7, np.float32)
    depth[10:50, 10:50] = 0.4
    part = np.zeros(depth.shape, bool)
    part[9:51, 9:51] = True  # its outline is on what lies behind
    solid = solid_depth(depth, part, 0.001)
    assert (solid - depth)[30, 30] == pytest.approx(0.001 * 42 / np.sqrt(np.pi), abs=1e-5)


@pytest.mark.parametrize("guided", [True, False])
def test_a_bare_hand_before_a_room_has_no_occluder(guided: bool) -> None:
    assert observed(replace(HOLDING, held_object="none"), 2, guided)[0].occluder is None


def test_small_objects_and_those_switched_off_are_left_out() -> None:
    assert observed(replace(HOLDING, held_size=0.012), 2, guided=True)[0].occluder is None
    assert observed(HOLDING, 2, guided=True, enabled=False)[0].occluder is None


def test_an_object_does_not_change_the_rest_of_the_observation() -> None:
    (one, _), (other, _) = (observed(HOLDING, 2, guided=True, enabled=enabled) for enabled in (True, False))
    np.testing.assert_array_equal(one.silhouette, other.silhouette)
    np.testing.assert_array_equal(one.depth, other.depth)
