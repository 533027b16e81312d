"""Score many poses against one observation.

The score is the energy E of Oikonomidis et al. 2011, Eq. (1).
Usage: 06_score_hypotheses.py FOLDER
"""

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import depthtrack as dt
from depthtrack.hand.pose import retract


def main(folder: str, count: int = 1000, renderer: str = "raster") -> NDArray[np.float64]:
    """Return the energies (count,) of poses ever farther from the true one, the first."""
    recording = dt.synthesise("everyday", Path(folder) / "recording", frames=1, overwrite=True)
    (tracked,) = dt.track(recording, "truth", start="truth")
    assert tracked.observation is not None
    assert recording.ground_truth is not None
    assert recording.ground_truth.poses is not None
    # Standard deviations in the tangent space: 3 of position (m), 3 of rotation and 20 of finger angles (rad).
    spread = np.repeat([0.02, 0.2, 0.3], [3, 3, 20]) * np.linspace(0, 1, count)[:, None]
    steps = np.random.default_rng(0).standard_normal((count, 26)) * spread
    poses = retract(recording.ground_truth.poses[0], steps)
    with dt.create_scorer(renderer, dt.HandShape()) as scorer:
        scorer.set_target(tracked.observation)
        energies = scorer.score(poses)
    for part in np.array_split(energies, 5):
        print(f"{len(part)} hypotheses: energy {part.min():.1f} to {part.max():.1f}")
    return energies


if __name__ == "__main__":
    main(sys.argv[1])
