"""Measure how the error grows with the distance from the camera.

Synthetic recordings have exact ground truth.
Usage: 04_synthetic_benchmark.py FOLDER
"""

import sys
from pathlib import Path

import depthtrack as dt


def main(folder: str, frames: int = 90, distances: tuple[float, ...] = (0.5, 1.0, 1.5)) -> dict[float, float | None]:
    """Print and return the mean endpoint error (mm) at each distance (m)."""
    errors = {}
    for distance in distances:
        place = Path(folder) / f"{distance:g}-m"
        recording = dt.synthesise(
            "grasp",
            place / "recording",
            distance=distance,
            sensor="kinect1",
            model="skin",
            frames=frames,
            overwrite=True,
        )
        run = dt.track(recording, "truth", "ik", out=place / "run", resume=True)
        metric = dt.evaluate(run).metric("endpoint_error_mm")
        assert metric is not None  # a synthetic recording has ground truth
        errors[distance] = metric.statistics()["mean"]
        print(f"{distance:g} m: {errors[distance]:.2f} mm")
    return errors


if __name__ == "__main__":
    main(sys.argv[1])
