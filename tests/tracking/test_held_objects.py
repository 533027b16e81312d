"""A hand behind an object that it holds is tracked, and lying before the object costs more."""

from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from depthtrack.geometry.rectangle import Rect
from depthtrack.hand.kinematics import HandModel
from depthtrack.recording import Frame
from depthtrack.rendering.backends import create_scorer
from depthtrack.rendering.options import Objective
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.options import OccluderOptions, SegmentationOptions
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.segmentation.skin_colour import SkinColourModel
from depthtrack.synthesis.generate import Synthesis, Synthesiser
from depthtrack.tracking.candidate import evaluate, seen_part
from depthtrack.tracking.guided_segmentation import roi_prior
from depthtrack.tracking.registry import create_tracker, tracker_config

HOLDING = Synthesis("everyday", frames=60, model="skin", sensor="kinect1", viewpoint=4, held_object="sphere")


@pytest.fixture(scope="module")
def made() -> Synthesiser:
    return Synthesiser(HOLDING)


@pytest.fixture(scope="module")
def observations(made: Synthesiser) -> list[Observation]:
    """Return the observations of the first frames, segmented around the true hand."""
    options, model = SegmentationOptions(occluder=OccluderOptions(True)), HandModel(HOLDING.hand)
    segmenter = Segmenter(SkinColourModel.default(options.skin_colour.prior), options)
    found = []
    for index in range(3):
        frame, camera = made[index], made.sensor.camera
        read = Frame(index, frame.timestamp, frame.depth.astype(np.float32), frame.colour, camera)
        found.append(segmenter.segment(read, roi_prior(model, made.poses[index])))
    return [each for each in found if each is not None]


def test_only_a_hand_before_the_object_costs_more_than_without_it(
    made: Synthesiser, observations: list[Observation]
) -> None:
    first = replace(observations[0], surroundings=None)
    assert first.occluder is not None
    nearer = made.poses[0].copy()
    nearer[2] -= 0.05
    with create_scorer("raster", HOLDING.hand) as scorer:
        scorer.set_target(first)
        true, before = scorer.score(np.stack([made.poses[0], nearer]))
        scorer.set_target(replace(first, occluder=None))
        free_true, free_before = scorer.score(np.stack([made.poses[0], nearer]))
    assert true < 1.02 * free_true
    assert before > free_before + 0.1


def test_what_the_object_hides_does_not_count_against_a_pose(
    made: Synthesiser, observations: list[Observation]
) -> None:
    first, pose = observations[0], made.poses[0]
    with create_scorer("raster", HOLDING.hand) as scorer:
        scorer.set_target(first)
        rendered, (whole,) = scorer.render(pose), evaluate(scorer, pose[None])
    seen = seen_part(whole, rendered, first, Objective())
    assert seen.energy < 0.9 * whole.energy
    assert seen.agreement > whole.agreement
    free = replace(first, occluder=None, surroundings=None)
    assert seen_part(whole, rendered, free, Objective()) is whole


def test_neither_a_forearm_before_the_hand_nor_the_border_counts_as_a_wrong_hand(
    made: Synthesiser, observations: list[Observation]
) -> None:
    """A forearm is before half of the hand; then the image ends in the middle of the hand."""
    first, pose = replace(observations[0], occluder=None), made.poses[0]
    columns = np.arange(first.camera.width) < int(first.camera.project(pose[:3])[0])
    readings, silhouette = np.where(columns, np.float32(0), first.depth), first.silhouette & ~columns
    hidden = replace(
        first, silhouette=silhouette, depth=readings, surroundings=np.where(columns, np.float32(0.3), readings * 0)
    )
    camera = made.sensor.camera
    outside = replace(hidden, surroundings=None, frame_camera=camera.crop(Rect.of_size(0, 0, 1, camera.height)))
    with closing(create_tracker(tracker_config("ik"), HOLDING.hand)) as tracker:
        whole, seen, unexplained, cut = (
            tracker.start(each, pose)
            for each in (first, hidden, replace(hidden, surroundings=None, frame_camera=None), outside)
        )
    assert seen.comparable_energy < 1.2 * whole.comparable_energy
    assert seen.energy < 1.2 * whole.energy
    assert unexplained.energy > 1.5 * whole.energy
    assert unexplained.comparable_energy == unexplained.energy
    assert cut.comparable_energy == Objective().clamp


@pytest.mark.parametrize("name", ["ik", "pso", "hybrid"])
def test_the_hand_is_tracked_and_hidden_fingers_are_reported(
    made: Synthesiser, observations: list[Observation], name: str
) -> None:
    model = HandModel(HOLDING.hand)
    with closing(create_tracker(tracker_config(name), HOLDING.hand)) as tracker:
        estimates = [tracker.start(observations[0], made.poses[0]), *map(tracker.track, observations[1:])]
    pose = estimates[-1].pose
    assert pose is not None
    errors = np.linalg.norm(model.endpoints(pose) - model.endpoints(made.poses[2]), axis=-1)
    assert np.median(errors) < 0.01
    # The sphere lies before the base of the middle finger.
    assert min(estimates[-1].visibility) < 0.9
