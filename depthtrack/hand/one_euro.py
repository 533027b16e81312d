"""The one-euro filter of poses: a low-pass filter whose cut-off grows with the speed.

Source: Casiez, Roussel and Vogel, "1€ filter: a simple speed-based low-pass filter for noisy input in interactive
systems", CHI 2012. A pose is filtered in its tangent space: palm position, palm orientation and each finger angle.
"""

from dataclasses import dataclass

import numpy as np

from depthtrack.errors import InputError
from depthtrack.hand.pose import TANGENT_SIZE, retract, tangent_between
from depthtrack.options import option
from depthtrack.types import Array

_SOURCE = "Casiez et al. 2012, Sec. 2"
_TRANSLATION, _ROTATION, _ANGLES = slice(0, 3), slice(3, 6), slice(6, TANGENT_SIZE)


@dataclass(frozen=True)
class OneEuroOptions:
    """Cut-off frequencies: at rest, their growth with speed, and that of the speed itself."""

    min_cutoff: float = option(4.0, "Cut-off at rest; lower is smoother and later", unit="Hz", source=_SOURCE)
    position_beta: float = option(30.0, "Growth of the cut-off of the position with its speed", unit="Hz per m/s")
    rotation_beta: float = option(6.0, "Growth of the cut-off of the orientation with its speed", unit="Hz per rad/s")
    angle_beta: float = option(3.0, "Growth of the cut-off of a finger angle with its speed", unit="Hz per rad/s")
    speed_cutoff: float = option(1.0, "Cut-off of the speeds", unit="Hz", source=_SOURCE)
    longest_gap: float = option(0.3, "Time without a pose after which the filter starts again", unit="s")

    def __post_init__(self) -> None:
        """Check the frequencies. Raises InputError if one is out of range."""
        for cutoff in (self.min_cutoff, self.speed_cutoff):
            if not 0 < cutoff < np.inf:  # false for NaN
                raise InputError(f"cut-off frequencies must be finite and above 0 Hz, found {cutoff:g}")
        if min(self.position_beta, self.rotation_beta, self.angle_beta) < 0:
            raise InputError("the growth of cut-off frequencies must be at least 0")


class OneEuroFilter:
    """Filters the poses of one hand as they arrive."""

    def __init__(self, options: OneEuroOptions | None = None) -> None:
        self.options = options or OneEuroOptions()
        self.delay: Array = np.zeros(3)
        """Seconds by which position, orientation and finger angles (mean) lag behind steady motion in the last pose."""
        self._filtered: Array | None = None
        self._last: tuple[Array, float]
        self._speed: Array

    def update(self, pose: Array | None, timestamp: float) -> Array | None:
        """Return the filtered pose (27,) of a pose at a time; None if `pose` is.

        timestamp: seconds, later than that of the pose before.
        """
        if pose is None:
            return None
        if self._filtered is None or not 0 < timestamp - self._last[1] <= self.options.longest_gap:
            self._filtered, self._speed, self.delay = pose.copy(), np.zeros(TANGENT_SIZE), np.zeros(3)
        else:
            step = timestamp - self._last[1]
            speed = tangent_between(self._last[0], pose) / step
            self._speed = self._speed + _share(self.options.speed_cutoff, step) * (speed - self._speed)
            cutoff = self._cutoffs()
            change = _share(cutoff, step) * tangent_between(self._filtered, pose)
            self._filtered = retract(self._filtered, change)
            lag = 1 / (2 * np.pi * cutoff)
            self.delay = np.array([lag[0], lag[3], lag[_ANGLES].mean()])
        self._last = pose, timestamp
        return self._filtered.copy()

    def _cutoffs(self) -> Array:
        """Return the cut-off frequencies (26,), Hz."""
        options, speed = self.options, self._speed
        growth = np.empty(TANGENT_SIZE)
        growth[_TRANSLATION] = options.position_beta * np.linalg.norm(speed[_TRANSLATION])
        growth[_ROTATION] = options.rotation_beta * np.linalg.norm(speed[_ROTATION])
        growth[_ANGLES] = options.angle_beta * np.abs(speed[_ANGLES])
        return options.min_cutoff + growth


def smooth(poses: Array, timestamps: Array, options: OneEuroOptions | None = None) -> tuple[Array, Array]:
    """Return filtered poses (T, 27) and their delays (T, 3), s; see `OneEuroFilter`.

    Both are NaN in rows without a pose.
    """
    filter_, smoothed, delays = OneEuroFilter(options), poses.copy(), np.full((len(poses), 3), np.nan)
    for row in np.flatnonzero(np.isfinite(poses).all(axis=1)):
        filtered = filter_.update(poses[row], float(timestamps[row]))
        if filtered is not None:
            smoothed[row], delays[row] = filtered, filter_.delay
    return smoothed, delays


def _share(cutoff: Array | float, step: float) -> Array:
    """Return the weight of the new value in a low-pass filter.

    cutoff: Hz.
    step: s.
    """
    lag = 1 / (2 * np.pi * np.asarray(cutoff))
    return np.asarray(1 / (1 + lag / step))
