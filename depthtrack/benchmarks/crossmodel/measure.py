"""Measurements of one recording: side, starts, and tracks with a calibrated hand."""

from contextlib import closing
from time import perf_counter
from typing import Any

import numpy as np

from depthtrack.benchmarks.crossmodel.recordings import made_recording
from depthtrack.calibration.calibrate import Calibration
from depthtrack.calibration.sides import calibrate_either_side
from depthtrack.evaluation.metrics import without_offsets
from depthtrack.evaluation.metrics.offsets import corrected_keypoints, joint_offsets
from depthtrack.evaluation.sweep.rows import Row
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import ANGLES
from depthtrack.recording.sequence import Sequence
from depthtrack.rendering.visibility import points_in_view
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.solver.keypoints import fit_poses
from depthtrack.tracking.guided_segmentation import segment_start
from depthtrack.tracking.pipeline import Pipeline, track_frames
from depthtrack.tracking.registry import create_tracker, tracker_config
from depthtrack.tracking.stages.branches import PALM_AND_BACK, turned
from depthtrack.types import Array, Mask

TRACKERS = ("hybrid", "ik")
WRONG = 0.02
"""Metres: mean joint error after removing offsets from which on a pose is on a wrong branch."""
CORRECTED_WITHIN = 30
"""Frames in which a start with palm and back exchanged should be corrected."""
START_EVERY = 15
"""Frames between single-frame starts."""
HALF_OPEN = np.radians(45)
"""Largest mean flexion of an open or half-open hand, rad."""


def measure(**recording: Any) -> Row:
    """Return the figures of a recording, whose options are those of `made_recording`."""
    with made_recording(**recording) as sequence:
        begun = perf_counter()
        found = calibrate_either_side(sequence)
        row: Row = {
            "side_right": found.hand.side == recording["side"],
            "side_sure": found.side_sure,
            "side_margin": found.side_margin,
            "calibration_s": perf_counter() - begun,
        }
        joints = np.array([true_joints(sequence, index) for index in range(len(sequence))])
        visible = np.array([visible_joints(sequence, index, joints[index]) for index in range(len(sequence))])
        row |= _starts(sequence, found, joints)
        row |= _corrections(sequence, found, joints)
        for name in TRACKERS:
            row |= {f"{name}_{key}": value for key, value in _tracks(sequence, found, name, joints, visible).items()}
    return row


def true_joints(sequence: Sequence, index: int) -> Array:
    """Return the true keypoints (21, 3) of a frame, metres, camera frame."""
    truth = sequence.ground_truth
    assert truth is not None
    joints = truth.keypoints_at(float(sequence.timestamps[index]))
    assert joints is not None
    return joints


def visible_joints(sequence: Sequence, index: int, joints: Array) -> Mask:
    """Return which of the true keypoints (21, 3) of a frame no surface hides."""
    depth = sequence.exact_depth(index)
    assert depth is not None
    return points_in_view(joints, depth, sequence.camera)


def _starts(sequence: Sequence, found: Calibration, joints: Array) -> Row:
    """Return the number of single-frame starts, and of those on the right branch.

    The offsets removed are those of poses fitted to the true joints. Wrong starts do not change them.
    """
    model, truth, segmenter = HandModel(found.hand), sequence.ground_truth, Segmenter.for_sequence(sequence)
    assert truth is not None
    poses, indices = list[Array](), list[int]()
    with closing(create_tracker(tracker_config("hybrid"), found.hand)) as tracker:
        for index in range(0, len(sequence), START_EVERY):
            segmenter.reset()
            observation = segment_start(sequence[index], segmenter, model)
            pose = None if observation is None else tracker.start(observation).pose
            poses.append(np.full(27, np.nan) if pose is None else pose)
            indices.append(index)
    offsets = joint_offsets(model, fit_poses(model, joints).poses, joints)
    points = corrected_keypoints(model, np.array(poses), offsets)
    errors = np.linalg.norm(points - joints[indices], axis=2).mean(axis=1)
    right = errors < WRONG
    flexions = (
        truth.poses[indices][:, ANGLES].reshape(-1, 5, 4)[:, :, 1:].mean(axis=(1, 2)) if truth.poses is not None else 0
    )
    half_open = np.broadcast_to(np.asarray(flexions < HALF_OPEN), right.shape)
    return {
        "starts": len(right),
        "starts_right": int(right.sum()),
        "open_starts": int(half_open.sum()),
        "open_starts_right": int((right & half_open).sum()),
    }


def _corrections(sequence: Sequence, found: Calibration, joints: Array) -> Row:
    """Return how many starts had palm and back exchanged, and how many were corrected."""
    model, segmenter = HandModel(found.hand), Segmenter.for_sequence(sequence)
    stretches = [range(begun, begun + CORRECTED_WITHIN) for begun in range(0, len(sequence), CORRECTED_WITHIN)]
    stretches = [stretch for stretch in stretches if stretch.stop <= len(sequence)]
    corrected = 0
    with closing(create_tracker(tracker_config("hybrid"), found.hand)) as tracker:
        for stretch in stretches:
            segmenter.reset()
            first, last = fit_poses(model, joints[[stretch[0], stretch[-1]]]).poses
            pipeline = Pipeline(tracker, segmenter, found.hand, turned(first, np.zeros((0, 20)))[PALM_AND_BACK])
            *_, end = track_frames(sequence.frames(list(stretch)), pipeline)
            if end.estimate.pose is not None:
                apart = model.keypoints(np.stack([end.estimate.pose, last]))
                corrected += bool(np.linalg.norm(apart[0] - apart[1], axis=1).mean() < WRONG)
    return {"exchanged": len(stretches), "exchanged_corrected": corrected}


def _tracks(sequence: Sequence, found: Calibration, name: str, joints: Array, visible: Mask) -> Row:
    """Return the figures of a tracker on the whole recording, mm; absent poses have no error."""
    model, poses = HandModel(found.hand), np.full((len(sequence), 27), np.nan)
    trusted = np.zeros(len(sequence), dtype=np.bool_)
    with closing(create_tracker(tracker_config(name), found.hand)) as tracker:
        pipeline = Pipeline(tracker, Segmenter.for_sequence(sequence), found.hand)
        for each in track_frames(sequence, pipeline):
            if each.estimate.pose is not None:
                poses[each.frame.index] = each.estimate.pose
            trusted[each.frame.index] = each.estimate.status.is_trusted
    known = np.isfinite(poses).all(axis=1)
    raw = np.full((len(poses), 21), np.nan)
    raw[known] = np.linalg.norm(model.keypoints(poses[known]) - joints[known], axis=2)
    errors = _errors(model, poses, joints)
    means = errors.mean(axis=1)
    wrong = trusted & ~(means < WRONG)
    return {
        "raw_mm": 1e3 * float(np.nanmean(raw)),
        "mean_mm": 1e3 * float(np.nanmean(errors)),
        "p95_mm": 1e3 * float(np.nanpercentile(means, 95)),
        "visible_mm": 1e3 * float(np.nanmean(errors[visible])),
        "hidden_mm": 1e3 * float(np.nanmean(errors[~visible])) if (~visible).any() else None,
        "untrusted_percent": 100 * float((~trusted).mean()),
        "wrong_percent": 100 * float(wrong.mean()),
        "longest_wrong_s": _longest(wrong, sequence.timestamps),
    }


def _errors(model: HandModel, poses: Array, joints: Array) -> Array:
    """Return the distances (T, 21), metres, after removing each joint's constant offset."""
    return np.asarray(np.linalg.norm(without_offsets(model, poses, joints) - joints, axis=2))


def _longest(wrong: Mask, timestamps: Array) -> float:
    """Return the duration of the longest run of wrong frames, s."""
    longest, begun = 0.0, None
    for time, is_wrong in zip(timestamps, wrong, strict=True):
        begun = (time if begun is None else begun) if is_wrong else None
        longest = max(longest, 0.0 if begun is None else float(time - begun))
    return longest
