"""Errors of an optical motion capture system: noise, dropouts, ghosts and lost labels.

Dropouts come in bursts. Random numbers come from streams of one seed.
"""

from dataclasses import dataclass

import numpy as np

from depthtrack.errors import InputError
from depthtrack.synthesis.randomness import Stream, generator
from depthtrack.types import Array, Index, Mask

_NEAR = 0.03
"""Standard deviation of a ghost's distance from a marker, metres, each axis."""
_CLEAR = 0.008
"""Smallest distance of a new ghost from its marker, metres: cameras merge points that are closer."""
_FOLLOWS = 0.5
"""Share of the ghosts that move with a marker; the others stay in place."""
_TRIES = 20
"""Random places that are tried for each burst, so that it does not join another one."""


@dataclass(frozen=True)
class MeasurementErrors:
    """Errors of the measured points.

    noise: standard deviation, metres, each axis.
    dropouts: share of the samples that are missing, 0 to 0.9.
    bursts: shortest and longest dropout, seconds.
    ghosts: number of ghosts in each frame.
    ghost_lives: shortest and longest life of a ghost, seconds.
    complete_start: whether all markers, and no ghosts, are in the first frame.

    Raises:
        InputError: if a value is out of range.
    """

    noise: float = 0.0005
    dropouts: float = 0.05
    bursts: tuple[float, float] = (0.02, 0.25)
    ghosts: int = 2
    ghost_lives: tuple[float, float] = (0.02, 0.3)
    complete_start: bool = True

    def __post_init__(self) -> None:
        if not 0 <= self.noise <= 0.05:
            raise InputError(f"marker noise must lie between 0 and 50 mm, found {self.noise * 1000:g} mm")
        if not 0 <= self.dropouts <= 0.9:
            raise InputError(f"dropouts must lie between 0 and 90 %, found {self.dropouts * 100:g} %")
        if not 0 <= self.ghosts <= 100:
            raise InputError(f"the number of ghosts must lie between 0 and 100, found {self.ghosts}")
        for what, (shortest, longest) in (("bursts", self.bursts), ("lives of ghosts", self.ghost_lives)):
            if not 0 < shortest <= longest <= 60:
                raise InputError(f"{what} must last from above 0 to 60 s, found {shortest:g} to {longest:g} s")

    def measure(self, positions: Array, rate: float, seed: int) -> tuple[Array, Index]:
        """Return measured points (T, N, 3), metres, and the column (T, P) of each marker.

        positions: (T, P, 3) true markers, metres.

        A marker that was not measured has column -1, and a free column NaN. Columns have another order in each frame.
        """
        ghosts = self._ghosts(positions, rate, seed)
        points = np.concatenate([positions, ghosts], axis=1)
        points = points + generator(seed, 0, Stream.MARKERS).normal(0, self.noise, points.shape)
        points[:, : positions.shape[1]][self._missing(positions.shape[:2], rate, seed)] = np.nan
        shuffled, columns = shuffle_points(points, seed)
        return shuffled, columns[:, : positions.shape[1]]

    def _missing(self, shape: tuple[int, int], rate: float, seed: int) -> Mask:
        """Return whether a sample (T, P) is missing.

        Bursts are at random times, as many as their share needs.
        """
        missing, rng = np.zeros(shape, dtype=np.bool_), generator(seed, 0, Stream.DROPOUTS)
        least = int(self.complete_start)
        while missing.sum() < self.dropouts * missing[least:].size:
            length = max(round(rng.uniform(*self.bursts) * rate), 1)
            for _ in range(_TRIES):
                marker, first = rng.integers(shape[1]), int(rng.integers(1 - length, shape[0]))
                # A frame on either side keeps bursts apart.
                if not missing[max(first - 1, 0) : first + length + 1, marker].any():
                    break
            missing[max(first, least) : first + length, marker] = True
        return missing

    def _ghosts(self, positions: Array, rate: float, seed: int) -> Array:
        """Return ghosts (T, G, 3): points near a marker for a short time, one after the other."""
        count = len(positions)
        ghosts = np.full((count, self.ghosts, 3), np.nan)
        for ghost in range(self.ghosts):
            rng, first = generator(seed, ghost, Stream.GHOSTS), int(self.complete_start)
            while first < count:
                last = first + max(round(rng.uniform(*self.ghost_lives) * rate), 1)
                offset = rng.normal(0, _NEAR, 3)
                offset *= max(1.0, _CLEAR / float(np.linalg.norm(offset)))
                marker = positions[:, rng.integers(positions.shape[1])]
                ghosts[first:last, ghost] = (marker[first:last] if rng.random() < _FOLLOWS else marker[first]) + offset
                first = last
        return ghosts


def shuffle_points(points: Array, seed: int) -> tuple[Array, Index]:
    """Return the points of each frame in a random order, without labels.

    points: (T, P, 3) metres, NaN if missing.

    Returns:
        (T, N, 3) points, metres, the missing ones last, with N the largest number in a frame; and the column (T, P)
        of each point, -1 if it is missing.
    """
    present = np.isfinite(points).all(axis=-1)
    order = generator(seed, 0, Stream.SHUFFLE).random(present.shape)
    order[~present] = 2
    source = np.argsort(order, axis=1, kind="stable")
    columns = np.argsort(source, axis=1)
    shuffled = np.take_along_axis(points, source[..., None], axis=1)
    return shuffled[:, : int(present.sum(axis=1).max(initial=1))], np.where(present, columns, -1)
