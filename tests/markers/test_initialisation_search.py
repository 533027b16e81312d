"""Initialisation in any posture, with unknown sizes, ghosts, and several models."""

from functools import cache

import numpy as np
import pytest

from depthtrack.geometry.rotations import rotation_matrix
from depthtrack.hand.pose import ANGLES, make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.shape import HandShape, Side
from depthtrack.hand.size_parameters import COUNT, prior_covariance, resized
from depthtrack.markers.initialisation.assignment import assign_within
from depthtrack.markers.initialisation.finger_tables import FingerTables
from depthtrack.markers.initialisation.initialise import initialise
from depthtrack.markers.initialisation.options import SearchOptions
from depthtrack.markers.initialisation.palms import (
    match_triples,
    neighbourhood_centres,
    palms_of_postures,
    palms_of_triples,
    spread_quaternions,
)
from depthtrack.markers.initialisation.rigid_bodies import _fitted
from depthtrack.markers.initialisation.search import initialise_by_search
from depthtrack.markers.models.layout import load_layout
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.markers.models.sized_fit import PosturePrior, SizedFitter
from depthtrack.types import Array, Index

TURN = np.array([0.4, 0.5, -0.3, 0.7])
PATTERN = np.array([[0, 0, 0], [0.07, 0, 0], [0, 0.05, 0], [0.02, 0.01, 0.04], [0.05, 0.06, 0.03]])


@cache
def average(name: str, side: Side = "right") -> MarkerModel:
    return load_layout(name, HandShape(side=side))


def subject(name: str, side: Side, seed: int) -> MarkerModel:
    """Return a hand of its own sizes, with markers that are not quite where the layout has them."""
    rng = np.random.default_rng(seed)
    hand = resized(HandShape(side=side), rng.multivariate_normal(np.zeros(COUNT), prior_covariance()))
    model = load_layout(name, hand)
    return model.with_(offsets=model.offsets + rng.normal(0, 0.002, model.offsets.shape))


def shuffled(points: Array, seed: int) -> tuple[Array, Index]:
    order = np.random.default_rng(seed).permutation(len(points))
    return points[order], np.argsort(order)


def body(places: Array, name: str = "body") -> MarkerModel:
    count = len(places)
    return MarkerModel(name, tuple("abcdefgh"[:count]), np.zeros(count, dtype=np.int64), places, np.full(count, 0.0005))


@pytest.mark.parametrize(("posture", "side"), [("grasp", "right"), ("fist", "left"), ("two", "right")])
def test_hand_of_any_posture_starts_among_ghosts(posture: str, side: Side) -> None:
    pose = make_pose([0.2, 0.1, 0.5], TURN, POSTURES[posture])
    ghosts = np.random.default_rng(7).uniform(-0.15, 0.15, (3, 3)) + pose[:3]
    points, place = shuffled(np.concatenate([subject("13", side, 1).positions(pose), ghosts]), 2)
    started = initialise(points, [average("13", side)]).found[0]
    assert started.points.tolist() == place[:13].tolist()
    assert started.residual < 0.01
    assert started.confidence > 0.5
    assert started.margin > 0
    np.testing.assert_allclose(started.pose[ANGLES], pose[ANGLES], atol=np.radians(45))


def test_hand_starts_without_a_marker_of_the_palm() -> None:
    pose = make_pose([0.2, 0.1, 0.5], TURN, POSTURES["relaxed"])
    points, place = shuffled(subject("13", "right", 3).positions(pose)[1:], 4)
    started = initialise(points, [average("13")]).found[0]
    assert started.points.tolist() == [-1, *place.tolist()]


def test_hand_of_the_other_side_fits_worse() -> None:
    points = subject("19", "left", 5).positions(make_pose([0.2, 0.1, 0.5], TURN, POSTURES["grasp"]))
    right, left = (initialise(points, [average("19", side)]).found[0] for side in ("right", "left"))
    assert left.points.tolist() == list(range(19))
    assert left.energy < right.energy - 5


def test_hands_that_touch_and_a_body_start_without_clusters() -> None:
    right = subject("16", "right", 1).positions(make_pose([0, 0, 0.5], [1, 0, 0, 0], POSTURES["grasp"]))
    left = subject("13", "left", 2).positions(make_pose([0.02, 0.03, 0.57], [0, 0, 1, 0], POSTURES["relaxed"]))
    held = PATTERN @ rotation_matrix(TURN).T + [0.02, 0.1, 0.5]
    points, place = shuffled(np.concatenate([right, left, held]), 8)
    started = initialise(points, [average("13", "left"), body(PATTERN), average("16")])
    found = [model.points.tolist() for model in started.found]
    assert found == [place[16:29].tolist(), place[29:].tolist(), place[:16].tolist()]
    assert started.confidence == pytest.approx(np.prod([model.confidence for model in started.found]))


def test_too_few_points_start_no_model() -> None:
    points = subject("13", "right", 1).positions(make_pose([0, 0, 0.5], TURN, POSTURES["grasp"]))
    assert initialise(points[:5], [average("13")]).models == (None,)
    assert initialise(points[:2], [average("13"), body(PATTERN)]).models == (None, None)


def test_body_starts_with_missing_markers() -> None:
    clutter = np.random.default_rng(1).uniform(-0.2, 0.2, (20, 3))
    places = PATTERN @ rotation_matrix(TURN).T + [0.1, 0.2, 0.3]
    points, place = shuffled(np.concatenate([places[[0, 2, 3, 4]], clutter]), 1)
    started = initialise(points, [body(PATTERN)]).found[0]
    assert started.points.tolist() == [place[0], -1, *place[1:4].tolist()]
    np.testing.assert_allclose(started.model.positions(started.pose), places, atol=1e-9)


def test_places_without_points_are_no_hypothesis() -> None:
    fitter = SizedFitter(body(PATTERN), 0.001, PosturePrior.from_synergies(2, 0.35))
    assert _fitted(fitter, PATTERN + 0.1, PATTERN, 11.0) is None
    found = _fitted(fitter, PATTERN + 0.001, PATTERN, 11.0)
    assert found is not None
    assert found.points.tolist() == list(range(5))


def test_mirrored_body_does_not_start() -> None:
    found = initialise(PATTERN * [-1, 1, 1], [body(PATTERN)]).models[0]
    assert found is None or (found.points >= 0).sum() < len(PATTERN)


def test_symmetric_body_has_no_margin() -> None:
    square = np.array([[0, 0, 0], [0.05, 0, 0], [0.05, 0.05, 0], [0, 0.05, 0]])
    started = initialise(square, [body(square)]).found[0]
    assert started.margin == pytest.approx(0, abs=1e-6)
    assert started.confidence < 0.3


def test_two_equal_bodies_take_different_points() -> None:
    points = np.concatenate([PATTERN, PATTERN @ rotation_matrix(TURN).T + 0.2])
    first, second = initialise(points, [body(PATTERN, "first"), body(PATTERN, "second")]).found
    assert not set(first.points) & set(second.points)
    assert sorted([*first.points, *second.points]) == list(range(10))


def test_triples_give_the_palm() -> None:
    model, pose = average("13"), make_pose([0.2, 0.1, 0.5], TURN, POSTURES["fist"])
    T = model.kinematics.transforms(pose)[0, :3]
    palms = palms_of_triples(model, np.full(13, 0.001), model.positions(pose))
    assert np.abs(palms - T).max(axis=(1, 2)).min() < 1e-9
    few = np.empty((2, 3, 4))
    triples = np.array([[0, 1, 2]])
    assert match_triples(np.array(model.offsets), triples, np.full(13, 0.02), model.positions(pose), few) == 2


def test_postures_align_to_the_points_without_a_palm() -> None:
    model, pose = average("13"), make_pose([0.2, 0.1, 0.5], TURN, POSTURES["grasp"])
    palms = palms_of_postures(model, model.positions(pose), 150)
    assert np.abs(palms - model.kinematics.transforms(pose)[0, :3]).max(axis=(1, 2)).min() < 1e-6


def test_quaternions_are_spread_over_all_rotations() -> None:
    q = spread_quaternions(150)
    np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1)
    some = np.random.default_rng(0).normal(size=(500, 4))
    some /= np.linalg.norm(some, axis=1, keepdims=True)
    nearest = 2 * np.arccos(np.clip(np.abs(some @ q.T).max(axis=1), 0, 1))
    assert nearest.max() < np.radians(50)


def test_neighbourhoods_of_two_clusters_have_two_centres() -> None:
    cluster = np.random.default_rng(0).normal(0, 0.005, (5, 3))
    centres = neighbourhood_centres(np.concatenate([cluster, cluster + 0.5]), 5)
    np.testing.assert_allclose(np.sort(centres[:, 0]), [cluster[:, 0].mean(), 0.5 + cluster[:, 0].mean()])


def test_fingers_take_their_points_without_sharing() -> None:
    model, pose = average("19"), make_pose([0.2, 0.1, 0.5], TURN, POSTURES["two"])
    tables = FingerTables.of(SizedFitter(model, 0.001, PosturePrior.from_synergies(2, 0.35)), 0.012, 5.0)
    palm, points = model.kinematics.transforms(pose)[0, :3], model.positions(pose)
    assigned, energies, angles = tables.combinations(palm, points)
    assert (np.diff(energies) >= 0).all()
    assert angles.shape == (len(assigned), 20)
    for row in assigned:
        used = row[row >= 0]
        assert len(set(used.tolist())) == len(used)
    assert (assigned[0] == np.arange(19)).mean() > 0.7
    kept, _, _ = tables.with_fingers_released(palm, points, np.arange(19), (1, 2))
    others = [k for k in range(19) if (model.bodies[k] - 1) // 3 not in (1, 2)]
    assert (kept[:, others] == others).all()
    assert tables.best(np.stack([palm + 0.05, palm]), points, 1).tolist() == [1]


def test_missing_costs_bound_an_assignment() -> None:
    assert assign_within(np.array([[1.0, 3.0], [1.5, 9.0]]), 5.0).tolist() == [1, 0]
    assert assign_within(np.array([[1.0, 3.0], [1.5, 9.0]]), 1.2).tolist() == [0, -1]


def test_confidence_follows_the_temperature() -> None:
    pose = make_pose([0.2, 0.1, 0.5], TURN, POSTURES["fist"])
    points = subject("13", "right", 1).positions(pose)
    warm, cold = (initialise_by_search(points, (average("13"),), SearchOptions(temperature=t))[0] for t in (10.0, 0.5))
    assert warm is not None
    assert cold is not None
    assert cold.confidence > warm.confidence
