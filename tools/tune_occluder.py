"""Compare costs of a hand before an object on synthetic hands with a held object.

Usage: tune_occluder.py FOLDER [--seeds 10 11 12] [--costs 0 1 4] [--trackers ik hybrid pso] [--frames N]

The cost is `before_cost` of `rendering.options.Objective`; at 0 the poses are those without an occluder, unless a loss
differs. The tuning seeds are 10 to 12. Other seeds are for checks. Printed are the mean endpoint errors, mm, of each
cost, object and tracker, and the lost frames. Recordings and runs stay in the folder, from which an interrupted
comparison continues.
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np

import depthtrack
from depthtrack.segmentation.options import OccluderOptions, SegmentationOptions
from depthtrack.synthesis.held_object import HeldKind
from depthtrack.tracking.registry import tracker_config

OBJECTS: tuple[HeldKind, ...] = ("sphere", "cylinder", "box")


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("--seeds", type=int, nargs="+", default=[10, 11, 12])
    arguments.add_argument("--costs", type=float, nargs="+", default=[0.0, 1.0, 4.0])
    arguments.add_argument("--trackers", nargs="+", default=["ik", "hybrid", "pso"])
    arguments.add_argument("--frames", type=int, default=90)
    chosen = arguments.parse_args()
    for kind in OBJECTS:
        recordings = [(seed, recording(chosen.folder, kind, seed, chosen.frames)) for seed in chosen.seeds]
        for tracker in chosen.trackers:
            for cost in chosen.costs:
                found = [measured(chosen.folder, path, tracker, cost, seed) for seed, path in recordings]
                errors, lost = np.array(found).T
                print(
                    f"{kind} {tracker} cost {cost:g}: {errors.mean():.2f} mm ({errors.round(2)}), {lost.sum():g} lost"
                )


def recording(folder: Path, kind: HeldKind, seed: int, frames: int) -> Path:
    """Return the path of the recording of a hand that holds an object; it is made if missing."""
    path = folder / f"{kind}-{seed}"
    if not path.exists():
        scene: dict[str, Any] = {"sensor": "kinect1", "background": "room", "forearm": True, "model": "skin"}
        depthtrack.synthesise("everyday", path, held_object=kind, frames=frames, seed=seed, **scene)
    return path


def measured(folder: Path, path: Path, tracker: str, cost: float, seed: int) -> tuple[float, int]:
    """Return the mean endpoint error, mm, and the lost frames of a run; it is made if missing."""
    out = folder / f"run-{path.name}-{tracker}-{cost:g}"
    config = tracker_config(tracker, **{"seed": seed, "scoring.objective.before_cost": cost})
    options = SegmentationOptions(occluder=OccluderOptions(find_occluder=True))
    resume = (out / "run.json").exists()
    depthtrack.track(path, "truth", config, out=out, segmentation=options, resume=resume)
    evaluation = depthtrack.evaluate(out, residuals=False)
    error = evaluation.metric("endpoint_error_mm")
    assert error is not None, "a synthetic recording has ground truth"
    return float(error.judged.mean()), evaluation.lost_frames


if __name__ == "__main__":
    main()
