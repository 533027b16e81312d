"""Reprojection residuals of a run: its keypoints in the image against those of a file."""

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.evaluation.replay import run_hand
from depthtrack.geometry.camera import Camera
from depthtrack.hand.kinematics import HandModel
from depthtrack.recording.keypoints import KeypointFile
from depthtrack.recording.run_folder import Run
from depthtrack.types import Array


def keypoint_residuals(run: Run, camera: Camera, timestamps: ArrayLike, keypoints: KeypointFile) -> Array:
    """Return the median distance (T,) of the known keypoints from those of the pose, pixels.

    It is NaN for frames without a pose or keypoints.

    timestamps: (N,) of the frames of the recording, seconds.

    Raises:
        InputError: if `run.json` is malformed.
    """
    rows = keypoints.rows(timestamps)[run.index]
    pixels = np.where((rows >= 0)[:, None, None], keypoints.pixels[rows], np.nan)
    apart = np.linalg.norm(camera.project(HandModel(run_hand(run)).keypoints(run.poses)) - pixels, axis=-1)
    found = np.full(len(rows), np.nan)
    known = np.flatnonzero(np.isfinite(apart).any(axis=1))
    found[known] = np.nanmedian(apart[known], axis=1)
    return found
