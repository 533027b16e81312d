"""Particle swarm on the skin (Schroeder et al. 2015, Sec. 5.2)."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from depthtrack.markers.layout.nearest import Tree, nearest_rows
from depthtrack.markers.layout.quality import LayoutQuality
from depthtrack.markers.layout.sharing import share_rows
from depthtrack.solver.options import SwarmOptions
from depthtrack.solver.swarm import advance, minimise
from depthtrack.types import Array, Index


class FoundLayout(NamedTuple):
    """A layout (K,) of candidates and its energy."""

    rows: Index
    energy: float


class SurfaceSwarm:
    """Domain of a swarm whose particles are K stacked markers on feasible vertices.

    After each step, a marker is moved to the nearest vertex, and the velocity is what it moved by: Eq. (11).
    """

    def __init__(self, quality: LayoutQuality, count: int, pool: ThreadPoolExecutor | None = None) -> None:
        self._quality, self._count, self._pool = quality, count, pool
        self._points = np.ascontiguousarray(quality.candidates.rest)
        self._tree = Tree.of(self._points)
        self._rows: Index = np.empty((0, count), np.int64)
        self._least = np.empty(0)

    def positions(self, rows: Index) -> Array:
        """Return the positions (N, 3 K) of layouts (N, K)."""
        return self._points[rows].reshape(len(rows), -1)

    def rows(self, position: Array) -> Index:
        """Return the layouts (N, K) nearest to positions (N, 3 K)."""
        queries = np.ascontiguousarray(position).reshape(-1, 3)
        out = np.empty(len(queries), np.int64)

        def work(part: slice) -> None:
            nearest_rows(self._tree, queries[part], out[part])

        share_rows(self._pool, len(queries), work)
        return out.reshape(-1, self._count)

    def confined(self, particles: Array) -> Array:
        self._rows = self.rows(particles)
        self._least = np.full(len(particles), np.inf)
        return self.positions(self._rows)

    def advance(
        self, position: Array, velocity: Array, own_best: Array, best: Array, draws: Array, options: SwarmOptions
    ) -> None:
        before, far = position.copy(), np.full(position.shape[1], np.inf)
        weights = (options.cognitive, options.social, options.inertia)
        advance(position, velocity, own_best, best, draws, -far, far, *weights)
        self._rows = self.rows(position)
        position[:] = self.positions(self._rows)
        velocity[:] = position - before

    def randomise(self, position: Array, best: Array, generator: np.random.Generator, options: SwarmOptions) -> None:
        """Move one random marker of a share of the particles to a random vertex."""
        count = round(options.randomise * len(position))
        particles = generator.permutation(len(position))[:count]
        markers = generator.integers(self._count, size=count)
        self._rows[particles, markers] = self._quality.candidates.random_rows(count, generator)
        position[particles] = self.positions(self._rows[particles])

    def score(self, position: Array) -> Array:
        """Return the energies (N,) of the positions of the last step.

        Infinity stands for an energy that is no less than the particle's own best.
        """
        energies = self._quality.energies(self._rows, self._least, self._pool)
        self._least = np.minimum(self._least, energies)
        return energies


def swarm_layout(
    quality: LayoutQuality,
    count: int,
    generator: np.random.Generator,
    options: SwarmOptions,
    pool: ThreadPoolExecutor | None = None,
    progress: Callable[[float], None] = lambda energy: None,
    start: Index | None = None,
) -> FoundLayout:
    """Return the layout of `count` markers that a swarm on the skin finds.

    start: (count,) layout at which one particle begins; the others begin at random places.
    """
    swarm = SurfaceSwarm(quality, count, pool)
    first = quality.candidates.random_rows((options.particles, count), generator)
    if start is not None:
        first[0] = start
    found = minimise(swarm.score, swarm.positions(first), swarm, generator, options, progress)
    return FoundLayout(swarm.rows(found.position[None])[0], found.energy)
