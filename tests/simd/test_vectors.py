"""Every vector operation of compiled kernels agrees with numpy, lane by lane."""

from collections.abc import Callable
from typing import Any

import numba
import numpy as np
import pytest
from numba.core.errors import TypingError
from numpy.typing import NDArray

from depthtrack.simd import functions
from depthtrack.simd import vectors as simd
from depthtrack.simd.vectors import F32X16, F64X8, Vector, filler, loader, store

Lanes = NDArray[Any]
VECTORS = [pytest.param(vector, id=f"{vector.element}x{vector.lanes}") for vector in (F32X16, F64X8)]


def numbers(vector: Vector, seed: int, count: int) -> Lanes:
    """Return numbers (count, lanes) of both signs, some equal to each other, some 0."""
    values = np.random.default_rng(seed).normal(scale=10, size=(count, vector.lanes)).astype(str(vector.element))
    values[:, 1] = 0
    values[:, 2] = values[0, 2]
    return values


def results(vector: Vector, calculate: Callable[..., None], count: int, *operands: Lanes) -> Lanes:
    """Return the numbers (count, lanes) that a compiled function stores."""
    out = np.full(count * vector.lanes, np.nan, str(vector.element))
    calculate(out, *operands)
    return out.reshape(count, vector.lanes)


@pytest.mark.parametrize("vector", VECTORS)
def test_arithmetic_is_rounded_like_numpys(vector: Vector) -> None:
    load, n = loader(vector), vector.lanes

    @numba.njit
    def calculate(out: Lanes, a: Lanes, b: Lanes) -> None:
        x, y = load(a, 0), load(b, 0)
        store(out, 0, x + y)
        store(out, n, x - y)
        store(out, 2 * n, x * y)
        store(out, 3 * n, y / x)
        store(out, 4 * n, simd.vmin(x, y))
        store(out, 5 * n, simd.vmax(x, y))
        store(out, 6 * n, functions.vsqrt(functions.vabs(x)))
        store(out, 7 * n, functions.vfloor(x))
        store(out, 8 * n, 2.5 - x)
        store(out, 9 * n, x * b[3])
        store(out, 10 * n, simd.vmax(x, 1))

    x, y = numbers(vector, 1, 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        expected = [x + y, x - y, x * y, y / x, np.minimum(x, y), np.maximum(x, y)]
    expected += [np.sqrt(np.abs(x)), np.floor(x), np.float32(2.5) - x, x * y[3], np.maximum(x, 1)]
    np.testing.assert_array_equal(results(vector, calculate, 11, x, y), expected)


@pytest.mark.parametrize("vector", VECTORS)
def test_comparisons_make_masks_that_combine_and_select(vector: Vector) -> None:
    load, n = loader(vector), vector.lanes

    @numba.njit
    def calculate(out: Lanes, a: Lanes, b: Lanes) -> None:
        x, y = load(a, 0), load(b, 0)
        store(out, 0, simd.select(x > y, x, y))
        store(out, n, simd.select(x < y, x, -1.0))
        store(out, 2 * n, simd.select(x >= y, 2.0, y))
        store(out, 3 * n, simd.select(simd.both(x > 0.0, y > 0.0), x, 0.0))
        store(out, 4 * n, simd.select(simd.either(x > 0.0, 0.0 < y), x, 7))  # noqa: SIM300 (scalar first)

    x, y = numbers(vector, 2, 2)
    x[5] = y[6] = np.nan  # compares false with everything
    expected = [
        np.where(x > y, x, y),
        np.where(x < y, x, -1),
        np.where(x >= y, 2, y),
        np.where((x > 0) & (y > 0), x, 0),
        np.where((x > 0) | (y > 0), x, 7),
    ]
    np.testing.assert_array_equal(results(vector, calculate, 5, x, y), expected)


@pytest.mark.parametrize("vector", VECTORS)
def test_operations_across_lanes(vector: Vector) -> None:
    load, half = loader(vector), vector.lanes // 2

    @numba.njit
    def reduce(a: Lanes) -> tuple[float, float, tuple[float, float], tuple[float, float]]:
        x = load(a, 0)
        return functions.first(x), functions.vsum(x), functions.lowest_of_halves(x), functions.highest_of_halves(x)

    for x in numbers(vector, 3, 20):
        first, total, lowest, highest = reduce(x)
        assert first == x[0]
        assert lowest == (x[:half].min(), x[half:].min())
        assert highest == (x[:half].max(), x[half:].max())
        # Halves on halves: the order is part of the promise that scores have the same bits.
        halves = x.copy()
        while len(halves) > 1:
            halves = halves[: len(halves) // 2] + halves[len(halves) // 2 :]
        assert total == halves[0]


@pytest.mark.parametrize("vector", VECTORS)
def test_the_larger_lane_is_never_nan_unless_the_second_is(vector: Vector) -> None:
    load = loader(vector)

    @numba.njit
    def calculate(out: Lanes, a: Lanes, b: Lanes) -> None:
        store(out, 0, functions.max_or(load(a, 0), load(b, 0)))

    x, y = numbers(vector, 6, 2)
    x[3], y[4], x[5], x[6] = np.nan, np.nan, -np.inf, np.inf
    expected = np.where(x > y, x, y)
    assert expected[3] == y[3]
    np.testing.assert_array_equal(results(vector, calculate, 1, x, y), [expected])


def test_estimates_are_accurate_enough_for_one_newton_step() -> None:
    load = loader(F32X16)

    @numba.njit
    def calculate(out: Lanes, a: Lanes) -> None:
        x = load(a, 0)
        store(out, 0, functions.estimated_reciprocal(x))
        store(out, 16, functions.estimated_reciprocal_sqrt(x))

    for seed in range(50):
        x = np.exp(np.random.default_rng(seed).uniform(-40, 40, 16)).astype(np.float32)
        reciprocal, reciprocal_sqrt = results(F32X16, calculate, 2, x)
        np.testing.assert_allclose(reciprocal * x, 1, rtol=2**-11)
        np.testing.assert_allclose(reciprocal_sqrt * np.sqrt(x), 1, rtol=2**-11)
    # The kernel relies on NaN if there is no root, and on infinity at 0.
    x[:4] = -1, -1e-30, 0, 0
    reciprocal, reciprocal_sqrt = results(F32X16, calculate, 2, x)
    assert np.isnan(reciprocal_sqrt[:2]).all()
    assert np.isinf([reciprocal[2], reciprocal_sqrt[2]]).all()


@pytest.mark.parametrize("vector", VECTORS)
def test_lanes_are_read_and_written_at_any_index_and_nowhere_else(vector: Vector) -> None:
    load, fill = loader(vector), filler(vector)

    @numba.njit
    def copy(source: Lanes, at: int, target: Lanes, to: int) -> None:
        store(target, to, load(source, at) + fill(1.0))

    source = numbers(vector, 4, 3).ravel()
    for at in range(2 * vector.lanes + 1):
        for to in (0, 1, 7, vector.lanes + 3):
            target = np.zeros(3 * vector.lanes, str(vector.element))
            copy(source, at, target, to)
            expected = np.zeros_like(target)
            expected[to : to + vector.lanes] = source[at : at + vector.lanes] + 1
            np.testing.assert_array_equal(target, expected)


def test_narrowing_rounds_to_float32() -> None:
    load = loader(F64X8)

    @numba.njit
    def narrowed(a: Lanes, out: Lanes) -> None:
        store(out, 0, functions.narrow(load(a, 0)))

    x = np.random.default_rng(5).normal(size=8) * np.logspace(-50, 30, 8)
    out = np.empty(8, np.float32)
    narrowed(x, out)
    np.testing.assert_array_equal(out, x.astype(np.float32))


def test_vectors_of_different_kinds_do_not_mix() -> None:
    wide, narrow = loader(F64X8), loader(F32X16)
    with pytest.raises(TypingError):
        numba.njit(lambda a, b: functions.vsum(wide(a, 0) + narrow(b, 0)))(np.zeros(8), np.zeros(16, np.float32))
