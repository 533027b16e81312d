"""Whole numbers that are drawn quickly are those of numpy, and the next numbers too."""

import numpy as np
import pytest

from depthtrack.synthesis.randomness import Stream, _drawn, generator, uniform_of, uniform_words


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
@pytest.mark.parametrize("shape", [(2, 12, 16), (5, 7), (480, 640, 3), (4,), (1,)])
@pytest.mark.parametrize("before", [0, 1])
def test_whole_numbers_are_those_of_numpy(kind: type, shape: tuple[int, ...], before: int) -> None:
    quick, plain = (generator(3, 8, Stream.DEPTH) for _ in range(2))
    for rng in (quick, plain):
        rng.random(before, dtype=np.float32)  # an odd number leaves half a word
    for _ in range(2):
        drawn = _drawn(quick, shape, np.dtype(kind))
        assert drawn.dtype == kind
        assert np.array_equal(drawn, plain.integers(0, 1 << 8 * drawn.itemsize, shape, dtype=kind))
    assert quick.random() == plain.random()


@pytest.mark.parametrize("shape", [(48, 64), (5, 7)])
def test_words_become_the_uniform_numbers_of_numpy(shape: tuple[int, int]) -> None:
    words = uniform_words(generator(3, 8, Stream.DEPTH), shape)
    uniform = generator(3, 8, Stream.DEPTH).random(shape, dtype=np.float32)
    assert [uniform_of(word) for word in words.ravel()] == uniform.ravel().tolist()
