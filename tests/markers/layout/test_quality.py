"""Quality of layouts: condition numbers, distances and key-frames against plain numpy."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.errors import InputError
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import make_pose, retract
from depthtrack.hand.shape import HandShape, Side
from depthtrack.hand.skin.mesh import Skin
from depthtrack.markers.layout.candidates import Candidates
from depthtrack.markers.layout.condition import LANES, LARGEST, condition_numbers, least_conditions
from depthtrack.markers.layout.key_frames import key_frames
from depthtrack.markers.layout.options import OBJECTIVES, ConditionOptions, ExpectedOptions, Objective, QualityOptions
from depthtrack.markers.layout.quality import LayoutQuality
from depthtrack.markers.models.layout import Layout
from depthtrack.types import Array, Index

seeds = st.integers(0, 2**32 - 1)


def in_lanes(matrix: Array) -> Array:
    return np.repeat(np.ravel(matrix), LANES)


def condition_of(matrix: Array) -> float:
    n, out = len(matrix), np.empty(LANES)
    condition_numbers(in_lanes(matrix), n, np.empty(LANES * n), np.empty(LANES * n), out)
    assert (out == out[0]).all()
    return float(out[0])


def least_condition_of(matrix: Array) -> float:
    n, out = len(matrix), np.empty(LANES)
    least_conditions(in_lanes(matrix), n, np.empty(LANES * n), out)
    return float(out[0])


def test_lanes_are_independent() -> None:
    rng = np.random.default_rng(0)
    J = rng.normal(size=(LANES, 7, 5))
    J[2] = np.eye(7, 5)
    A = np.einsum("bij,bik->bjk", J, J)
    out, work = np.empty(LANES), np.empty((2, LANES * 5))
    condition_numbers(np.ascontiguousarray(np.moveaxis(A, 0, -1)).ravel(), 5, work[0], work[1], out)
    np.testing.assert_allclose(out, np.linalg.cond(A), rtol=1e-5)


@given(seed=seeds)
def test_condition_numbers_equal_those_of_singular_values(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 24))
    J = rng.normal(size=(n + int(rng.integers(0, 9)), n)) * 10 ** rng.uniform(-1.5, 1.5, n)
    expected = float(np.linalg.cond(J.T @ J))
    if expected < 1e9:
        assert condition_of(J.T @ J) == pytest.approx(expected, rel=1e-5)


@given(seed=seeds)
def test_the_lower_bound_is_below_the_condition_number(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 24))
    J = rng.normal(size=(n + int(rng.integers(0, 9)), n)) * 10 ** rng.uniform(-1.0, 1.0, n)
    assert 1 <= least_condition_of(J.T @ J) <= condition_of(J.T @ J) * (1 + 1e-6)


def test_a_singular_matrix_has_the_largest_condition_number() -> None:
    assert condition_of(np.zeros((4, 4))) == LARGEST
    assert condition_of(np.diag([1.0, 2.0, 0.0])) == LARGEST
    assert least_condition_of(np.diag([1.0, 2.0, 0.0])) == LARGEST


def oracle_jacobian(quality: LayoutQuality, layout: Index, posture: Array) -> Array:
    """Return the Jacobian (3 K, 3 + l) by rotation about the wrist and synergies."""
    hand = quality.candidates.hand
    model, pose = HandModel(hand), make_pose(np.zeros(3), [1.0, 0, 0, 0], posture)
    bodies, offsets = quality.candidates.bodies[layout], quality.candidates.offsets[layout]
    columns = []
    for k in range(3 + quality.options.components):
        ends = []
        for step in (-1e-5, 1e-5):
            tangent = np.zeros(26)
            if k < 3:
                tangent[3 + k] = step
            else:
                tangent[6:] = step * quality.synergies.components[:, k - 3]
            moved = retract(pose, tangent)
            # The wrist keeps its place.
            moved[:3] += model.wrist(pose) - model.wrist(moved)
            ends.append(model.transform_points(moved, bodies, offsets).ravel())
        columns.append((ends[1] - ends[0]) / 2e-5)
    return np.stack(columns, axis=1)


def oracle_energy(quality: LayoutQuality, layout: Index) -> float:
    conditions, least = [], np.inf
    for posture in quality.postures:
        J = oracle_jacobian(quality, layout, posture)
        conditions.append(np.linalg.cond(J.T @ J))
        pose = make_pose(np.zeros(3), [1.0, 0, 0, 0], posture)
        points = HandModel(quality.candidates.hand).transform_points(
            pose, quality.candidates.bodies[layout], quality.candidates.offsets[layout]
        )
        apart = np.linalg.norm(points[:, None] - points, axis=-1) + 10 * np.eye(len(layout))
        least = min(least, float(apart.min()))
    return float(0.1 * np.mean(conditions) - 100 * least / quality.placement.length)


def test_the_objective_equals_equations_5_to_9(quality: LayoutQuality) -> None:
    rng = np.random.default_rng(0)
    for layout in rng.integers(len(quality.candidates), size=(4, 6)):
        expected = oracle_energy(quality, layout)
        assert quality.energies(layout[None])[0] == pytest.approx(expected, rel=1e-5)


def test_a_bound_leaves_better_layouts_unchanged(quality: LayoutQuality) -> None:
    layouts = np.random.default_rng(1).integers(len(quality.candidates), size=(50, 5))
    energies = quality.energies(layouts)
    bounds = np.full(50, float(np.median(energies)))
    np.testing.assert_array_equal(quality.energies(layouts, bounds), np.where(energies < bounds, energies, np.inf))


def test_without_an_anchor_the_translation_is_eliminated(candidates: Candidates, postures: Array) -> None:
    alone = ConditionOptions(condition_weight=1.0, distance_weight=0.0)
    options = QualityOptions(objective="condition", key_frames=1, components=2, condition=alone)
    anchored = LayoutQuality.of(candidates, postures, options)
    free = LayoutQuality.of(candidates, postures, replace(options, anchored=False))
    layout = np.array([3, 400, 500, 700])
    J = oracle_jacobian(anchored, layout, anchored.postures[0]).reshape(4, 3, -1)
    J = (J - J.mean(axis=0)).reshape(12, -1)
    assert free.energies(layout[None])[0] == pytest.approx(np.linalg.cond(J.T @ J), rel=1e-4)
    assert free.fewest == 3
    assert anchored.fewest == 2


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_the_loss_of_the_worst_marker_counts_if_asked_for(
    objective: Objective, candidates: Candidates, postures: Array
) -> None:
    alone = ConditionOptions(condition_weight=1.0, distance_weight=0.0)
    options = QualityOptions(objective=objective, key_frames=3, components=2, condition=alone)
    plain = LayoutQuality.of(candidates, postures, options)
    robust = LayoutQuality.of(candidates, postures, replace(options, robust=True))
    layout = np.array([3, 400, 500, 700])
    terms, of_rest = plain.terms(layout), [plain.terms(np.delete(layout, k)) for k in range(4)]
    if objective == "condition":
        worst = max(terms.condition, *(rest.condition for rest in of_rest))
        assert terms.condition_lost == pytest.approx(worst)
    else:
        worst = 1000 * max(rest.error for rest in of_rest)
        assert 1000 * terms.error_lost == pytest.approx(worst)
    lost = robust.energies(layout[None])[0]
    assert lost - plain.energies(layout[None])[0] == pytest.approx(
        worst - (terms.condition if objective == "condition" else 1000 * terms.error)
    )
    grown = robust.grown(layout[:3])
    assert grown[700] == pytest.approx(lost)


def test_candidates_face_the_back_of_their_bone(candidates: Candidates) -> None:
    skin = Skin.of(candidates.hand)
    assert 500 < len(candidates) < 1500
    assert set(candidates.bodies) == set(range(16))
    distance = np.linalg.norm(skin.rest[:, None] - candidates.rest[None, ::50], axis=-1).min(axis=0)
    np.testing.assert_allclose(distance, candidates.radius, atol=1e-9)


@pytest.mark.parametrize("side", ["right", "left"])
def test_a_layout_of_candidates_puts_markers_where_they_are(side: Side, candidates: Candidates) -> None:
    if side == "left":
        candidates = Candidates.on_skin(HandShape(side=side))
    chosen = [int(group[len(group) // 2]) for group in candidates.by_body()]
    layout = candidates.layout(chosen, "one on each bone")
    placed = Candidates.of_model(layout.on(candidates.hand)).rest
    nearest = np.linalg.norm(placed[:, None] - candidates.rest[chosen], axis=-1).min(axis=0)
    assert nearest.max() < 0.002
    again = Layout.from_fields(json.loads(layout.to_json()))
    np.testing.assert_allclose(Candidates.of_model(again.on(candidates.hand)).rest, placed, atol=2e-5)


def test_key_frames_are_far_from_each_other() -> None:
    postures = np.zeros((50, 20))
    postures[:, 0] = np.linspace(0, 1, 50)
    postures[:, 1] = 0.001 * np.arange(50) % 2
    assert sorted(key_frames(postures, 3)[1:]) == [0, 49]
    assert len(key_frames(np.zeros((5, 20)), 3)) == 1


def test_options_out_of_range_are_rejected() -> None:
    for count in (0, 21):
        with pytest.raises(InputError):
            QualityOptions(components=count)
    with pytest.raises(InputError):
        QualityOptions(key_frames=0)
    with pytest.raises(InputError):
        ConditionOptions(condition_weight=-1.0)
    with pytest.raises(InputError):
        ExpectedOptions(residual=0.0)
