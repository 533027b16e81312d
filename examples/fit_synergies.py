"""Find the synergies of recorded postures, and what a hand can do with few of them: fit_synergies.py POSTURES OUT.json.

POSTURES is a .csv, .mat or .npz as `depthtrack synergies fit --help` describes; without it, a synthetic motion's.
"""

import sys
from pathlib import Path

import numpy as np

from depthtrack.hand.pose import ANGLES
from depthtrack.hand.synergies import Synergies, save_synergies
from depthtrack.posture_databases.registry import read_postures
from depthtrack.synthesis.motion import load_motion


def main(postures: str | None = None, out: str | None = None) -> Synergies:
    """Print how well the first components explain the postures; gives all of them."""
    if postures is None:
        angles = load_motion("signs").poses(np.arange(0, 10, 1 / 30), seed=0)[:, ANGLES]
    else:
        angles = read_postures(postures).angles
    synergies = Synergies.fit(angles, source=postures or "the motion 'signs'")
    for count in (1, 2, 3, 5, 8):
        few = synergies.truncated(count)
        error = np.degrees(np.abs(few.angles(few.project(angles)) - angles).mean())
        print(
            f"{count} components: {few.variance_share(count):6.1%} of the variance, {error:4.1f} degrees off on average"
        )
    if out is not None:
        save_synergies(synergies, Path(out))
    return synergies


if __name__ == "__main__":
    main(*sys.argv[1:])
