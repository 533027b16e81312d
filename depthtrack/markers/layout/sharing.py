"""Rows of a batch shared among threads, whose number changes no bits."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np

_PARTS = 8
"""Parts of a batch."""


def share_rows(pool: ThreadPoolExecutor | None, count: int, work: Callable[[slice], None]) -> None:
    """Call `work` with slices that cover `count` rows; without a pool, with all of them.

    work: reads and writes its rows alone, and releases the interpreter lock.
    """
    if pool is None:
        work(slice(0, count))
        return
    edges = np.linspace(0, count, _PARTS + 1).astype(int).tolist()
    list(pool.map(work, (slice(a, b) for a, b in pairwise(edges) if b > a)))
