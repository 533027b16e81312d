"""The run folder of one hand of a labelled capture, and the recording that it refers to."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from depthtrack.files import compact_json, write_atomic
from depthtrack.hand.pose import FINGERS
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.virtual_camera import virtual_camera
from depthtrack.recording.branches import BRANCH_COLUMNS
from depthtrack.recording.ground_truth import HAND_FILE, POSES_FILE, POSES_HEADER
from depthtrack.recording.run_rows import ROW_COLUMNS, RunRow, row_cells
from depthtrack.recording.run_tables import rewrite_table
from depthtrack.recording.sequences.capture import CAPTURE_FILE, CaptureDescription
from depthtrack.recording.status import Status
from depthtrack.tracking.configuration import MarkersConfig
from depthtrack.tracking.run_configuration import RunConfiguration, camera_fields, versions
from depthtrack.types import Array, Index, Mask

RECORDING = "recording"


def write_hand_run(
    folder: Path, labelled: LabelledCapture, k: int, name: str, truth: LabelledCapture | None = None
) -> None:
    """Write the run folder of the hand k.

    name: of the capture.
    truth: capture with the true poses of models of the same names, if they are known.

    Raises:
        InputError: if a file cannot be written.
    """
    model, poses = labelled.models[k], labelled.poses[k]
    assert model.hand is not None
    recording = folder / RECORDING
    recording.mkdir(parents=True, exist_ok=True)
    camera, T = virtual_camera(poses, model.kinematics.keypoints(poses))
    capture = CaptureDescription(name, labelled.capture.rate, len(labelled.capture), camera, T)
    write_atomic(recording / CAPTURE_FILE, capture.to_json())
    if truth is not None:
        _write_truth(recording, truth, model.name, labelled.capture)
    rewrite_table(folder / "poses.csv", ROW_COLUMNS, map(row_cells, run_rows(labelled, k)))
    indices = [[str(index)] for index in range(len(labelled.capture))]
    rewrite_table(folder / "timings.csv", ("index",), indices)
    rewrite_table(folder / "branches.csv", BRANCH_COLUMNS, ())
    configuration = RunConfiguration(
        RECORDING,
        camera_fields(camera),
        model.hand.to_fields(),
        MarkersConfig(),
        context={"label": f"markers {model.name}", "versions": versions()},
    )
    write_atomic(folder / "run.json", compact_json(configuration.to_fields()))


def run_rows(labelled: LabelledCapture, k: int) -> list[RunRow]:
    """Return a row for each frame of the hand k.

    The energy is the root mean square distance of the measured markers from those of the pose, mm. The visibility of a
    finger is the share of its markers that were measured.
    """
    poses, measured = labelled.poses[k], np.asarray(labelled.columns[k] >= 0)
    posed = np.asarray(np.isfinite(poses).all(axis=1))
    energy = _root_mean_square(1000 * labelled.residuals(k))
    visibility = _visibility(measured, (labelled.models[k].bodies - 1) // 3)
    rows = []
    for t, time in enumerate(labelled.capture.times):
        if posed[t]:
            status = Status.TRACKED if t > 0 and posed[t - 1] else Status.STARTED
        else:
            status = Status.LOST if measured[t].any() else Status.ABSENT
        pose = poses[t] if posed[t] else None
        shares = tuple(map(float, visibility[t]))
        rows.append(RunRow(t, float(time), status, float(energy[t]), np.nan, pose, visibility=shares))
    return rows


def _root_mean_square(values: Array) -> Array:
    """Return the root mean square (T,) of the finite values (T, M) of each row; NaN without any."""
    known = np.isfinite(values)
    count = known.sum(axis=1)
    total = np.sum(np.where(known, values, 0.0) ** 2, axis=1)
    return np.where(count > 0, np.sqrt(total / np.maximum(count, 1)), np.nan)


def _visibility(measured: Mask, finger: Index) -> Array:
    """Return the share (T, 5) of the measured markers of each finger; NaN without markers."""
    out = np.full((len(measured), len(FINGERS)), np.nan)
    for f in range(len(FINGERS)):
        if np.any(finger == f):
            out[:, f] = measured[:, finger == f].mean(axis=1)
    return out


def _write_truth(recording: Path, truth: LabelledCapture, name: str, capture: MarkerCapture) -> None:
    """Write the true sizes and poses of the hand of this name, if it is among the true ones.

    capture: may have a part of the true frames; numbers of frames count.
    """
    skipped = capture.first_frame - truth.capture.first_frame
    for model, poses in zip(truth.models, truth.poses, strict=True):
        if model.name == name and model.hand is not None and skipped >= 0:
            part = poses[skipped : skipped + len(capture)]
            if not np.isfinite(part).all(axis=1).any():
                continue
            write_atomic(recording / HAND_FILE, model.hand.to_json())
            rewrite_table(recording / POSES_FILE, POSES_HEADER, _pose_cells(capture.times[: len(part)], part))


def _pose_cells(times: Array, poses: Array) -> Sequence[list[str]]:
    known = np.isfinite(poses).all(axis=1)
    return [list(map(repr, [float(t), *pose.tolist()])) for t, pose in zip(times[known], poses[known], strict=True)]
