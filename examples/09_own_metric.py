"""Write a metric of your own: how wrong the opening between thumb and index finger is.

Usage: 09_own_metric.py RUN
"""

import sys

import numpy as np

import depthtrack as dt

TIPS = [dt.KEYPOINT_NAMES.index(name) for name in ("thumb_tip", "index_tip")]


def opening_error(run: dt.Run, truth: dt.GroundTruth) -> dt.Metric:
    """Return the error of the opening in each frame, mm; NaN without a pose or ground truth."""
    nowhere = np.full((21, 3), np.nan)
    annotated = [truth.keypoints_at(float(time)) for time in run.timestamps]
    true_keypoints = np.array([nowhere if keypoints is None else keypoints for keypoints in annotated])
    estimated, true = (
        np.linalg.norm(np.diff(keypoints[:, TIPS], axis=1)[:, 0], axis=1)
        for keypoints in (dt.joint_track(run).keypoints, true_keypoints)
    )
    return dt.Metric("opening_error_mm", "mm", 1000 * np.abs(estimated - true))


def main(folder: str) -> dt.Metric:
    """Print the statistics of the metric; return it."""
    run = dt.read_run(folder)
    truth = dt.open_recording(run.configuration["sequence"]).ground_truth
    if truth is None:
        raise dt.InputError("the recording must have ground truth, found none: take a synthetic one")
    metric = opening_error(run, truth)
    for name, value in metric.statistics().items():
        print(f"{name}: {value:.2f} {metric.unit}" if value is not None else f"{name}: none")
    return metric


if __name__ == "__main__":
    main(sys.argv[1])
