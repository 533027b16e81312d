"""Random natural motion from a seed: a random walk of the palm with random postures.

A posture is either a named one with small variation, or sampled with the couplings of real fingers:

- The first synergy closes all fingers together (Santello, Flanders and Soechting, "Postural hand synergies for tool
  use", 1998).
- The distal joint bends by two thirds of the one before it (Rijpkema and Girard, "Computer animation of
  knowledge-based human grasping", 1991).
- Abduction decreases as the fingers bend.

Transitions with self-collision are rejected.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator

from depthtrack.errors import InputError
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.pose import ANGLES, make_pose
from depthtrack.hand.shape import HandShape
from depthtrack.synthesis import motion_file
from depthtrack.synthesis.clearance import Clearance
from depthtrack.synthesis.randomness import Stream, generator
from depthtrack.synthesis.scene_frame import orientation
from depthtrack.types import Array

_LARGEST_OVERLAP = 0.003
_TRIES = 20
_WANDER = ("right", "down", "away", "tilt", "nod", "turn")
_SPREAD = np.radians([0, 13, 1, -9, -20])
"""Abduction of the straight fingers of a spread hand."""


@dataclass(frozen=True)
class RandomMotion:
    """A random motion; see the module.

    postures (N, 20): named postures, radians.
    drawn: share of postures that are sampled, 0 to 1.
    hold, move, wander: shortest and longest duration of a posture, a transition and a step of the palm, seconds.
    ranges (6, 2): limits of position (metres) and orientation angles (radians), scene frame.
    elbow (3,): metres, scene frame.
    """

    name: str
    about: str
    postures: Array
    drawn: float
    hold: tuple[float, float]
    move: tuple[float, float]
    wander: tuple[float, float]
    ranges: Array
    elbow: Array
    duration: None = None

    @classmethod
    def from_table(cls, name: str, table: dict[str, Any], where: str) -> "RandomMotion":
        """Return the motion of a parsed file; `where` names it in error messages.

        Raises: InputError if an entry is missing, unknown or out of range.
        """
        motion_file.check_names(table, ("about", "random", "postures", "elbow"), where)
        postures = motion_file.shared_postures(table, where)
        options = motion_file.table(table, "random", where)
        motion_file.check_names(
            options, ("postures", "drawn", "hold", "move", "wander", *_WANDER), f"{where}, [random]"
        )
        names = options.get("postures")
        if not isinstance(names, list) or not names or any(not isinstance(n, str) or n not in postures for n in names):
            raise InputError(f"{where}, [random]: postures must be a list of some of {', '.join(postures)}")
        ranges = np.array([_range(options, n, -720, 720, where) for n in _WANDER])
        return cls(
            name,
            motion_file.text(table, "about", where),
            np.stack([postures[n] for n in names]),
            motion_file.number(options, "drawn", 0, 1, where),
            _range(options, "hold", 0, 60, where),
            _range(options, "move", 0.05, 60, where),
            _range(options, "wander", 0.05, 60, where),
            np.concatenate([ranges[:3] / 1000, np.radians(ranges[3:])]),
            motion_file.elbow(table, where),
        )

    def poses(self, times: ArrayLike, seed: int) -> Array:
        """See `Motion`. A longer motion of the same seed has the shorter one as its prefix."""
        t = np.asarray(times, dtype=np.float64)
        end = float(t.max(initial=0))
        angles = PchipInterpolator(*self._posture_keys(end, seed))(t)
        right, down, away, tilt, nod, turn = (self._wander(n, end, seed)(t) for n in range(len(_WANDER)))
        return make_pose(np.stack([right, down, away], axis=-1), orientation(tilt, nod, turn), angles)

    def _posture_keys(self, end: float, seed: int) -> tuple[Array, Array]:
        """Return key times (K,), seconds, and angles (K, 20); two keys hold each posture."""
        clearance = Clearance(HandShape())
        times, angles = [0.0], [self.postures[0]]
        while len(times) < 5 or times[-4] <= end:
            rng = generator(seed, len(times), Stream.POSTURES)
            times.append(times[-1] + max(rng.uniform(*self.hold), 1e-3))
            angles.append(angles[-1])
            times.append(times[-1] + rng.uniform(*self.move))
            angles.append(self._next(angles[-1], rng, clearance))
        return np.array(times), np.stack(angles)

    def _next(self, current: Array, rng: np.random.Generator, clearance: Clearance) -> Array:
        """Return a posture that a collision-free transition reaches, else the current one."""
        for _ in range(_TRIES):
            candidate = self._draw(rng)
            # Between two held postures the interpolation runs along the straight line.
            path = current + np.linspace(0, 1, 26)[1:, None] * (candidate - current)
            if clearance.penetration(_posed(path)).max() < _LARGEST_OVERLAP:
                return candidate
        return current

    def _draw(self, rng: np.random.Generator) -> Array:
        if rng.random() < self.drawn:
            return coupled_posture(rng)
        known = self.postures[rng.integers(len(self.postures))]
        return np.clip(known + rng.normal(0, np.radians(3), 20), LOWER, UPPER)

    def _wander(self, channel: int, end: float, seed: int) -> PchipInterpolator:
        def draw(step: int) -> np.random.Generator:
            return generator(seed, step * len(_WANDER) + channel, Stream.WANDERING)

        return smooth_walk(self.ranges[channel], self.wander, end, draw)


def smooth_walk(
    limits: ArrayLike, durations: tuple[float, float], end: float, draw: Callable[[int], np.random.Generator]
) -> PchipInterpolator:
    """Return a smooth random walk within limits, 0 s to `end`: an AR(1) process through tanh.

    durations: shortest and longest step, seconds.
    draw: returns the random numbers of a step.
    """
    low, high = np.asarray(limits)
    times, values = [0.0], [0.0]
    while len(times) < 5 or times[-3] <= end:
        rng = draw(len(times))
        times.append(times[-1] + rng.uniform(*durations))
        values.append(0.6 * values[-1] + 0.8 * rng.normal())
    return PchipInterpolator(np.array(times), (low + high) / 2 + (high - low) / 2 * np.tanh(np.array(values)))


def coupled_posture(rng: np.random.Generator) -> Array:
    """Return a random posture (20,), radians, with the joint couplings of real fingers."""
    closing = rng.beta(0.8, 0.8)
    # Neighbouring fingers correlate: a random walk from index to little finger about the common closing.
    own = np.clip(closing + np.cumsum(rng.normal(0, 0.12, 4)), 0, 1)
    balance = rng.uniform(0.55, 1.0)  # share of the closing at the knuckles
    pip = np.radians(100) * own
    fingers = np.stack(
        [
            _SPREAD[1:] * rng.uniform(0.2, 1.0) * (1 - own),
            np.radians(85) * own * balance,
            pip,
            2 / 3 * pip,
        ],
        axis=-1,
    )
    # The thumb opposes as the fingers close.
    opposing = np.clip(closing + rng.normal(0, 0.2), 0, 1)
    thumb = np.radians([rng.uniform(-8, 16), -16 + 30 * opposing, 35 * opposing, 45 * opposing])
    return np.clip(np.concatenate([thumb, fingers.ravel()]), LOWER, UPPER)


def _posed(angles: Array) -> Array:
    poses = np.zeros((*angles.shape[:-1], 27))
    poses[..., 3] = 1
    poses[..., ANGLES] = angles
    return poses


def _range(table: dict[str, Any], name: str, low: float, high: float, where: str) -> tuple[float, float]:
    pair = motion_file.numbers(table.get(name), 2, max(abs(low), abs(high)), f"{where}, [random]: {name}")
    if not low <= pair[0] <= pair[1]:
        raise InputError(
            f"{where}, [random]: {name} must be a smallest and a largest value of at least {low:g}, found {pair}"
        )
    return float(pair[0]), float(pair[1])
