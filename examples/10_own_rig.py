"""Use a rigged hand mesh of your own (glTF): record it, and track it with its own surface.

Usage: 10_own_rig.py HAND.glb FOLDER
"""

import sys
from pathlib import Path

import depthtrack as dt


def main(rig: str, folder: str, frames: int = 30) -> float | None:
    """Print and return the mean endpoint error, mm."""
    hand = dt.open_hand(rig)
    print(f"a {hand.side} hand; its index finger is {1000 * hand.scale * hand.lengths[1].sum():.0f} mm long")
    place = Path(folder)
    recording = dt.synthesise("everyday", place / "recording", hand=hand, model="skin", frames=frames, overwrite=True)
    run = dt.track(recording, hand, "ik", out=place / "run", resume=True)
    metric = dt.evaluate(run).metric("endpoint_error_mm")
    assert metric is not None  # a synthetic recording has ground truth
    mean = metric.statistics()["mean"]
    print(f"mean endpoint error: {mean:.2f} mm")
    return mean


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
