"""From an optical marker capture to joint angles for OpenSim.

Usage: 13_markers_to_angles.py CAPTURE.c3d MODEL FOLDER

MODEL is a layout of markers on the hand, such as 26 or left:16. The model of an earlier capture of the same subject
(FOLDER/models/right.json) is better. Markers without a label are found. FOLDER gets labels, sizes and poses.
"""

import sys
from pathlib import Path

import numpy as np

import depthtrack


def main(capture: str, model: str, folder: str) -> Path:
    """Write the joint angles of the hand, gaps filled; return the path of the file."""
    solution = depthtrack.solve_markers(capture, [model], out=folder)
    hand = solution.labelled.models[0]
    for name, (size, deviation) in solution.sizes()[hand.name].items():
        print(f"{name:18} {1000 * size:6.1f} mm, standard deviation {1000 * deviation:.1f} mm")
    print(f"markers are {1000 * np.nanmean(solution.labelled.residuals(0)):.2f} mm from those of the poses")

    filled = depthtrack.fill_markers(folder, out=f"{folder}-filled")
    open_gaps = [gap for gap in filled.gaps() if not filled.is_filled(gap)]
    print(f"{len(filled.gaps()) - len(open_gaps)} gaps filled, {len(open_gaps)} left")

    angles = Path(f"{folder}-filled") / "angles.mot"
    depthtrack.export_run(f"{folder}-filled/{hand.name}", angles)
    return angles


if __name__ == "__main__":
    print(main(*sys.argv[1:]))
