"""The choice of the next frame if several have arrived while the last one was tracked."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike


@dataclass(frozen=True)
class LateFrames:
    """Frames to drop when late.

    A tracker follows a hand in a fraction of the time between frames, but a search takes many frames. To go on from the
    newest frame after a search would need the next search, since the hand has moved. So the frames between are tracked,
    with small gaps, until the newest one is reached.

    longest_step: largest time between tracked frames while catching up, s.
    longest_delay: time behind the newest frame above which the frames between are dropped, s.
    """

    longest_step: float = 0.1
    longest_delay: float = 1.0

    def choose(self, timestamps: ArrayLike, last: float | None) -> int:
        """Return the index of the frame to track next, among those that wait.

        timestamps: (N,) of the waiting frames, s, increasing; at least one.
        last: time of the last tracked frame, s; None for none.
        """
        times = np.asarray(timestamps, dtype=np.float64)
        if last is None or times[-1] - last > self.longest_delay:
            return len(times) - 1
        return max(int(np.searchsorted(times, last + self.longest_step + _ROUNDING, side="right")) - 1, 0)


_ROUNDING = 1e-6
"""Seconds, of time stamps."""
