"""Models that claim common points: the best choice, and what counts in its confidence."""

import numpy as np
import pytest

from depthtrack.hand.size_parameters import COUNT
from depthtrack.markers.initialisation.hypotheses import Hypothesis
from depthtrack.markers.initialisation.joint_choice import choose_jointly


def hypothesis(points: list[int], energy: float) -> Hypothesis:
    return Hypothesis(np.array(points), energy, np.zeros(27), np.zeros(COUNT))


def test_the_best_disjoint_pair_is_chosen_with_its_probability() -> None:
    first = [hypothesis([0, 1], 1.0), hypothesis([0, 2], 3.0)]
    second = [hypothesis([1, 3], 2.0), hypothesis([4, 3], 8.0)]
    chosen = choose_jointly({5: first, 7: second}, {5: 50.0, 7: 50.0}, 1.0)
    # Of the pairs, energies 1 + 2 have point 1 in common; 3 + 2, 1 + 8 and 3 + 8 have none.
    assert chosen[5] is not None
    assert chosen[7] is not None
    assert (chosen[5].hypothesis, chosen[7].hypothesis) == (first[1], second[0])
    weights = np.exp(-np.array([5.0, 9.0, 11.0]))
    assert chosen[5].confidence == pytest.approx((weights[0] + weights[2]) / weights.sum())
    assert chosen[7].confidence == pytest.approx(weights[0] / weights.sum())
    assert (chosen[5].margin, chosen[7].margin) == (4.0, 4.0)
    warm = choose_jointly({5: first, 7: second}, {5: 50.0, 7: 50.0}, 2.0)
    assert warm[7] is not None
    assert warm[7].confidence < chosen[7].confidence


def test_a_model_that_leaves_no_points_is_absent() -> None:
    chosen = choose_jointly({0: [hypothesis([0, 1], 1.0)], 1: [hypothesis([1, 2], 4.0)]}, {0: 9.0, 1: 9.0}, 1.0)
    assert chosen[1] is None
    assert chosen[0] is not None
    assert chosen[0].margin == pytest.approx(3.0)
    assert choose_jointly({0: []}, {0: 5.0}, 1.0) == {0: None}
