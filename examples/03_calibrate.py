"""Measure the hand of a recording, then track it with these sizes.

Usage: 03_calibrate.py RECORDING HAND.json RUN
"""

import sys
from pathlib import Path

import depthtrack as dt


def main(path: str, hand_file: str, out: str) -> dt.Run:
    """Print the measured sizes and write them to `hand_file`; return the run with them."""
    calibration = dt.calibrate(path, progress=lambda stage, share: print(f"{share:4.0%} {stage}"))
    for name, size in calibration.measured.items():
        print(f"{name:16} {size.mm:6.1f} mm, standard deviation {size.sigma_mm:4.1f} mm")
    Path(hand_file).write_text(calibration.to_json())
    return dt.track(path, hand_file, out=out)


if __name__ == "__main__":
    main(*sys.argv[1:])
