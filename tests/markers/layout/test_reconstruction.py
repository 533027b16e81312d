"""Poses from sparse markers, and the baselines of layouts."""

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.hand.pose import make_pose, tangent_between
from depthtrack.hand.skin.mesh import Skin
from depthtrack.hand.synergies import Synergies
from depthtrack.markers.layout.candidates import Candidates
from depthtrack.markers.layout.expected_error import VertexErrors
from depthtrack.markers.layout.manual import MANUAL_BONES, manual_layout
from depthtrack.markers.layout.reconstruction import Method, ReconstructionOptions, reconstruct
from depthtrack.markers.layout.wheatland import random_base, wheatland_layout
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.types import Array


def model_and_poses(candidates: Candidates, synergies: Synergies) -> tuple[MarkerModel, Array]:
    """Return a hand of five markers, and a motion (12, 27) in the subspace."""
    model = manual_layout("4F-1T").on(candidates.hand)
    turn = np.linspace(0, 0.5, 12)[:, None]
    few = synergies.truncated(3)
    coefficients = few.lower + np.linspace(0.3, 0.7, 12)[:, None] * (few.upper - few.lower)
    quaternion = np.concatenate([np.cos(turn), 0 * turn, np.sin(turn), 0 * turn], axis=1)
    return model, make_pose(np.concatenate([turn, turn, turn], axis=1), quaternion, few.angles(coefficients))


def test_postures_of_the_subspace_are_found_from_few_markers(candidates: Candidates, postures: Array) -> None:
    synergies = Synergies.fit(postures)
    model, truth = model_and_poses(candidates, synergies)
    wrist = model.kinematics.wrist(truth)
    errors = {}
    methods: tuple[Method, ...] = ("subspace", "prior", "plain")
    for method in methods:
        options = ReconstructionOptions(method=method, components=3, iterations=20)
        poses = reconstruct(model, model.positions(truth), synergies, options, wrist)
        errors[method] = np.abs(tangent_between(poses, truth)).max()
    assert errors["subspace"] < 1e-3
    assert errors["prior"] < 0.1
    assert errors["plain"] > 2 * errors["prior"]


def test_missing_markers_keep_the_posture_plausible(candidates: Candidates, postures: Array) -> None:
    synergies = Synergies.fit(postures)
    model, truth = model_and_poses(candidates, synergies)
    positions = model.positions(truth)
    positions[4:8, 2] = np.nan
    poses = reconstruct(model, positions, synergies, ReconstructionOptions(components=3), model.kinematics.wrist(truth))
    assert np.isfinite(poses).all()
    assert VertexErrors.between(Skin.of(candidates.hand), poses, truth).mean.max() < 0.003
    positions[0, 2:] = np.nan
    with pytest.raises(InputError, match="three markers at least, found 2"):
        reconstruct(model, positions, synergies)


def test_vertex_errors_are_those_of_a_shift(candidates: Candidates) -> None:
    pose = make_pose(np.zeros(3), [1.0, 0, 0, 0], np.zeros(20))[None]
    moved = pose + np.eye(27)[0] * 0.01
    errors = VertexErrors.between(Skin.of(candidates.hand), moved, pose)
    np.testing.assert_allclose([errors.mean, errors.largest], 0.01)


@pytest.mark.parametrize("name", list(MANUAL_BONES))
def test_manual_layouts_have_the_markers_of_their_name(name: str, candidates: Candidates) -> None:
    fingers, thumb = (int(part[0]) for part in name.split("-"))
    model = manual_layout(name).on(candidates.hand)
    assert sum(label.startswith("thumb") for label in model.labels) == thumb
    assert len(model.labels) == fingers + thumb


def test_wheatland_prefers_the_markers_that_move_most(candidates: Candidates, postures: Array) -> None:
    base = random_base(candidates, 1, np.random.default_rng(0))
    assert len(base) == 16
    only_index = np.tile(postures.mean(axis=0), (20, 1))
    only_index[:, 5] += np.linspace(0, 1, 20)
    chosen = wheatland_layout(candidates, base, only_index, 3)
    assert sorted(candidates.bodies[chosen]) == [4, 5, 6]
