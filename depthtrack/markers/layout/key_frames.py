"""Key-frames: postures that represent a motion (Schroeder et al. 2015, Sec. 5)."""

import numpy as np

from depthtrack.types import Array, Index


def key_frames(postures: Array, count: int) -> Index:
    """Return the rows (up to `count`) of postures (N, 20) by farthest-point selection.

    The first is the posture nearest to the mean. Each next one is farthest from those chosen (Gonzalez 1985). Postures
    equal to chosen ones are left out.
    """
    distance = np.sum((postures - postures.mean(axis=0)) ** 2, axis=1)
    chosen = [int(np.argmin(distance))]
    nearest = np.sum((postures - postures[chosen[0]]) ** 2, axis=1)
    while len(chosen) < count:
        farthest = int(np.argmax(nearest))
        if nearest[farthest] <= 0:
            break
        chosen.append(farthest)
        nearest = np.minimum(nearest, np.sum((postures - postures[farthest]) ** 2, axis=1))
    return np.array(chosen, dtype=np.int64)
