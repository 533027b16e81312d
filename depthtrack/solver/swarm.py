"""Particle swarm optimisation in a domain (Oikonomidis et al. 2011, Sec. 2.4).

Constriction PSO after Clerc and Kennedy 2002, "nearest point" bounds after Helwig and Wanka 2007. Partial
randomisation after Yasuda et al. 2010 keeps the fingers from collapsing into the first minimum.
"""

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.solver.options import SwarmOptions
from depthtrack.types import Array, Index


class Optimum(NamedTuple):
    """Best positions of the particles of a swarm.

    positions: (N, D) best position of each particle.
    energies: (N,) their energies.
    best: row of the best particle.
    """

    positions: Array
    energies: Array
    best: int

    @property
    def position(self) -> Array:
        """Best position (D,) of the swarm."""
        return self.positions[self.best]

    @property
    def energy(self) -> float:
        """Energy of the best position."""
        return float(self.energies[self.best])


class Domain(Protocol):
    """Where the particles of a swarm may be, and how they move there."""

    def confined(self, particles: Array) -> Array:
        """Return the positions (N, D) of the domain nearest to given ones."""
        ...

    def advance(
        self, position: Array, velocity: Array, own_best: Array, best: Array, draws: Array, options: SwarmOptions
    ) -> None:
        """Move all particles one step, in place; see `advance`."""
        ...

    def randomise(self, position: Array, best: Array, generator: np.random.Generator, options: SwarmOptions) -> None:
        """Replace a part of some positions (N, D) by random values, in place.

        best: (D,) of the swarm.
        """
        ...


class Box(NamedTuple):
    """A box, some of whose dimensions may be randomised.

    lower, upper: (D,) bounds.
    fingers: dimensions that may be randomised.
    """

    lower: Array
    upper: Array
    fingers: slice

    def confined(self, particles: Array) -> Array:
        return np.clip(particles, self.lower, self.upper)

    def advance(
        self, position: Array, velocity: Array, own_best: Array, best: Array, draws: Array, options: SwarmOptions
    ) -> None:
        weights = (options.cognitive, options.social, options.inertia)
        advance(position, velocity, own_best, best, draws, self.lower, self.upper, *weights)

    def randomise(self, position: Array, best: Array, generator: np.random.Generator, options: SwarmOptions) -> None:
        randomise(position, best, self.lower, self.upper, self.fingers, generator, options)


def minimise(
    score: Callable[[Array], Array],
    particles: Array,
    domain: Domain,
    generator: np.random.Generator,
    options: SwarmOptions,
    progress: Callable[[float], None] = lambda energy: None,
    is_over: Callable[[], bool] = lambda: False,
) -> Optimum:
    """Return the optimum of a swarm within a domain.

    score: returns energies (N,) of positions (N, D).
    particles: (N, D) positions of the first generation.
    progress: receives the least energy after each generation.
    is_over: whether the other generations are left out; asked before each of them.

    The number of evaluations is N times `options.generations` then, at most. Equal generator states give equal bits.
    """
    position = domain.confined(particles)
    velocity = np.zeros_like(position)
    energy = score(position)
    own_best, own_energy = position.copy(), energy.copy()
    best, draws = int(np.argmin(own_energy)), np.empty((2, *position.shape))
    progress(float(own_energy[best]))
    for generation in range(1, options.generations):
        if is_over():
            break
        generator.random(out=draws)
        domain.advance(position, velocity, own_best, own_best[best], draws, options)
        if options.randomise_every and generation % options.randomise_every == 0:
            domain.randomise(position, own_best[best], generator, options)
        energy = score(position)
        best = keep_better(position, energy, own_best, own_energy)
        progress(float(own_energy[best]))
    return Optimum(own_best, own_energy, best)


@compiled()
def advance(
    position: Array,
    velocity: Array,
    own_best: Array,
    best: Array,
    draws: Array,
    lower: Array,
    upper: Array,
    cognitive: float,
    social: float,
    inertia: float,
) -> None:
    """Advance all particles by Eq. (3) and (4), in place.

    A particle that would leave the box stops at its nearest point.

    position, velocity, own_best: (N, D).
    best: (D,).
    draws: (2, N, D) uniform in 0..1, r1 and r2.
    """
    for n in range(position.shape[0]):
        for d in range(position.shape[1]):
            x = position[n, d]
            pull = cognitive * draws[0, n, d] * (own_best[n, d] - x) + social * draws[1, n, d] * (best[d] - x)
            velocity[n, d] = inertia * (velocity[n, d] + pull)
            position[n, d] = min(max(x + velocity[n, d], lower[d]), upper[d])


@compiled()
def keep_lowest(energy: Array, agreement: Array, least: Array, kept: Array) -> None:
    """Keep the lower of two energies of each particle, and its agreement, in place.

    energy, agreement, least, kept: (N,).
    """
    for n in range(energy.shape[0]):
        if energy[n] < least[n]:
            least[n], kept[n] = energy[n], agreement[n]


@compiled()
def keep_better(position: Array, energy: Array, own_best: Array, own_energy: Array) -> int:
    """Keep the positions whose energies are lower than their particles' best, in place.

    position, own_best: (N, D).
    energy, own_energy: (N,).

    Returns the row of the swarm's best, the first of equal ones.
    """
    best = 0
    for n in range(position.shape[0]):
        if energy[n] < own_energy[n]:
            own_energy[n] = energy[n]
            for d in range(position.shape[1]):
                own_best[n, d] = position[n, d]
        if own_energy[n] < own_energy[best]:
            best = n
    return best


def randomise(
    position: Array,
    best: Array,
    lower: Array,
    upper: Array,
    fingers: slice,
    generator: np.random.Generator,
    options: SwarmOptions,
) -> None:
    """Replace one random finger dimension of a share of the particles, in place (Sec. 2.4)."""
    count, near = round(options.randomise * len(position)), options.near_best
    rows = generator.permutation(len(position))
    dimensions, values = generator.integers(fingers.start, fingers.stop, count), generator.random(count)
    normal = generator.standard_normal(count) if near > 0 else values
    choice = generator.random(count) if near > 0 else np.ones(count)
    replace(position, best, lower, upper, rows, dimensions, (values, normal, choice), near, options.near_spread)


@compiled()
def replace(
    position: Array,
    best: Array,
    lower: Array,
    upper: Array,
    rows: Index,
    dimensions: Index,
    draws: tuple[Array, Array, Array],
    near_best: float,
    near_spread: float,
) -> None:
    """Replace one dimension of some particles by a random value within its bounds, in place.

    rows, dimensions: (K,) or more particles, and (K,) the dimension of each.
    draws: (K,) uniform in 0..1 the value between the bounds, normal the distance from the swarm's best, and uniform
        in 0..1 the choice between both: below `near_best`, the value is near the best.
    """
    values, normal, choice = draws
    for k in range(dimensions.shape[0]):
        d = dimensions[k]
        value = lower[d] + (upper[d] - lower[d]) * values[k]
        if choice[k] < near_best:
            value = best[d] + near_spread * normal[k]
        position[rows[k], d] = min(max(value, lower[d]), upper[d])
