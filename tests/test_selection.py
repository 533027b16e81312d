"""Test the greedy choice: chosen items differ, and others are near an earlier chosen one."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.selection import distinct


@given(st.lists(st.integers(0, 30), max_size=12), st.integers(1, 6), st.integers(1, 12))
def test_chosen_items_differ_and_others_are_near_an_earlier_one(places: list[int], least: int, count: int) -> None:
    x = np.array(places, dtype=np.float64)
    chosen = distinct(range(len(x)), lambda i, before: np.abs(x[i] - x[before]), least, count)
    assert len(chosen) <= count
    assert chosen == sorted(chosen)
    for k, i in enumerate(chosen):
        assert all(abs(x[i] - x[j]) >= least for j in chosen[:k])
    last = chosen[-1] if len(chosen) == count else len(x)
    for i in set(range(last)) - set(chosen):
        assert any(abs(x[i] - x[j]) < least for j in chosen if j < i)


def test_an_unknown_distance_counts_as_too_small() -> None:
    x = np.array([0.0, np.nan, 5.0])
    assert distinct(range(3), lambda i, before: np.abs(x[i] - x[before]), 1.0, 3) == [0, 2]
