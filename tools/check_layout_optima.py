"""Check that layouts are optimal for the objective of Schroeder et al. 2015.

    python tools/check_layout_optima.py TRAINING K    # as: grasps 4

The layout is that of `markers layout --objective condition`, for a training set of `reproduce schroeder2015-9`.

- Exchanges of two markers: all of them.
- Four markers: all layouts of every fifth place, and exchanges from the best 200 of them.
"""

import sys
from itertools import combinations

import numpy as np

from depthtrack.benchmarks.papers.schroeder2015 import quality_of
from depthtrack.markers.layout.exchange import exchanged, greedy_layout
from depthtrack.markers.layout.quality import LayoutQuality
from depthtrack.markers.layout.search import find_layout_of
from depthtrack.types import Array, Index

STEP = 5
BEST = 200


def least_of_pairs(quality: LayoutQuality, layout: Index, energy: float) -> float:
    """Return the least energy of the layouts that differ from `layout` (K,) in two markers."""
    least = energy
    for pair in combinations(range(len(layout)), 2):
        kept = np.delete(layout, pair)
        for first in range(len(quality.candidates)):
            least = min(least, float(quality.grown(np.append(kept, first), least).min()))
    return least


def best_of_all(quality: LayoutQuality, bound: float) -> tuple[Index, Array]:
    """Return the `BEST` layouts (N, 4) of every `STEP`-th place, and their energies (N,).

    bound: energy from which a layout is of no interest.
    """
    places = np.arange(0, len(quality.candidates), STEP)
    kept, energies = np.empty((0, 4), np.int64), np.empty(0)
    for a, first in enumerate(places):
        rest = np.array(list(combinations(places[a + 1 :], 3)), dtype=np.int64).reshape(-1, 3)
        layouts = np.column_stack([np.full(len(rest), first), rest])
        limit = bound if len(energies) < BEST else min(bound, float(energies.max()))
        found = quality.energies(layouts, np.full(len(layouts), limit))
        kept, energies = np.concatenate([kept, layouts]), np.concatenate([energies, found])
        order = np.argsort(energies, kind="stable")[:BEST]
        kept, energies = kept[order], energies[order]
    finite = np.isfinite(energies)
    return kept[finite], energies[finite]


def main(training: str, count: int) -> None:
    """Print the energies."""
    quality = quality_of(training, count, "paper")
    found, greedy = find_layout_of(quality, count, threads=1), greedy_layout(quality, count)
    print(f"{training}, {count} markers: found {found.energy:.6f}, greedy {greedy.energy:.6f}")
    print(f"least of all exchanges of two markers: {least_of_pairs(quality, found.rows, found.energy):.6f}", flush=True)
    if count == 4:
        layouts, energies = best_of_all(quality, found.energy + abs(found.energy))
        ends = [exchanged(quality, rows).energy for rows in layouts]
        print(f"every fifth place: least {energies.min():.6f}; least after exchanges from {len(ends)}: {min(ends):.6f}")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    main(sys.argv[1], int(sys.argv[2]))
