"""Fit hand synergies to postures, and write them for a tracker.

`tracker_config("ik", synergies="OUT.json", components=5)` uses them.
Usage: 07_synergies.py OUT.json [POSTURES.csv|.mat|.npz]. Without postures, those of a synthetic motion are used.
"""

import sys
from pathlib import Path

import numpy as np

import depthtrack as dt
from depthtrack.hand.pose import ANGLES
from depthtrack.hand.synergies import save_synergies
from depthtrack.posture_databases.registry import read_postures
from depthtrack.synthesis.motion import load_motion


def main(out: str, postures: str | None = None) -> dt.Synergies:
    """Print the variance and the error of the first components; return all of them."""
    if postures is None:
        angles = load_motion("signs").poses(np.arange(0, 10, 1 / 30), seed=0)[:, ANGLES]
    else:
        angles = read_postures(postures).angles
    synergies = dt.Synergies.fit(angles, source=postures or "the motion 'signs'")
    for count in (1, 2, 3, 5, 8):
        few = synergies.truncated(count)
        error = np.degrees(np.abs(few.angles(few.project(angles)) - angles).mean())
        print(f"{count} components: {few.variance_share(count):6.1%} of the variance, mean error {error:4.1f} degrees")
    save_synergies(synergies, Path(out))
    return synergies


if __name__ == "__main__":
    main(*sys.argv[1:])
