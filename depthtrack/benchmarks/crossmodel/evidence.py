"""Evidence, errors and spread in each frame of a recording, for the fit of the confidence.

Each recording is tracked with three hands: the calibrated one, the same of the other side, and the average hand.
"""

from contextlib import closing
from typing import Any

import numpy as np

from depthtrack.benchmarks.crossmodel.measure import TRACKERS, true_joints, visible_joints
from depthtrack.benchmarks.crossmodel.recordings import made_recording
from depthtrack.calibration.calibrate import calibrate
from depthtrack.evaluation.metrics.offsets import corrected_keypoints, joint_offsets
from depthtrack.evaluation.sweep.rows import Cell, Row
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape, Side, other_side
from depthtrack.recording.sequence import Sequence
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.solver.keypoints import fit_poses
from depthtrack.tracking.pipeline import Pipeline, track_frames
from depthtrack.tracking.registry import create_tracker, tracker_config
from depthtrack.types import Array, Mask

OFTEN = 0.1
"""Share of the frames from which on a joint is visible often enough for an offset of its own."""


def measure_evidence(cell: Cell) -> Row:
    """Return one entry per tracked frame.

    It holds hand, tracker, evidence, largest joint error (mm), and numbers of keypoints: visible, those of them with an
    error below their spread, hidden, and those of them.

    cell: arguments of `made_recording`.

    Constant offsets of the joints are removed from the errors of hands of the right side. They are those of the frames
    in which the camera sees the joint: wrong hidden fingers do not change them.
    """
    with made_recording(**cell) as sequence:
        side: Side = cell["side"]
        calibrated = calibrate(sequence, side).hand
        hands = {
            "calibrated": calibrated,
            "mirrored": calibrated.with_(side=other_side(side)),
            "average": HandShape(side=side),
        }
        joints = np.array([true_joints(sequence, index) for index in range(len(sequence))])
        visible = np.array([visible_joints(sequence, index, joints[index]) for index in range(len(sequence))])
        frames: list[Any] = []
        for kind, hand in hands.items():
            for name in TRACKERS:
                frames += [
                    [kind, name, *row] for row in _tracked(sequence, hand, name, joints, visible, kind != "mirrored")
                ]
    return {"tracked": frames}


def _tracked(
    sequence: Sequence, hand: HandShape, name: str, joints: Array, visible: Mask, aligned: bool
) -> list[tuple[list[float], float, int, int, int, int]]:
    """Return the entry of each frame with a pose, without hand and tracker.

    aligned: remove the constant offsets of the joints.
    """
    evidence: dict[int, list[float]] = {}
    spread = np.full((len(sequence), 21), np.nan)
    poses, model = np.full((len(sequence), 27), np.nan), HandModel(hand)
    with closing(create_tracker(tracker_config(name), hand)) as tracker:
        pipeline = Pipeline(tracker, Segmenter.for_sequence(sequence), hand)
        for each in track_frames(sequence, pipeline):
            if each.estimate.pose is not None and tracker.evidence is not None:
                poses[each.frame.index], spread[each.frame.index] = each.estimate.pose, each.estimate.spread
                evidence[each.frame.index] = [round(float(value), 5) for value in tracker.evidence]
    if not evidence:
        return []
    known = sorted(evidence)
    points = model.keypoints(poses[known])
    if aligned:
        points = corrected_keypoints(model, poses[known], _offsets(model, poses, joints, visible))
    errors = np.linalg.norm(points - joints[known], axis=2)
    within, shown = errors < spread[known], visible[known]
    counts = np.column_stack([part.sum(axis=1) for part in (shown, shown & within, ~shown, ~shown & within)]).tolist()
    largest = (1e3 * errors.max(axis=1)).round(2).tolist()
    return [(evidence[index], *row) for index, *row in zip(known, largest, *zip(*counts, strict=True), strict=True)]


def _offsets(model: HandModel, poses: Array, joints: Array, visible: Mask) -> Array:
    """Return the constant offsets (21, 3), metres, in the frames in which each joint is visible.

    A joint that is rarely visible has the offset of poses fitted to the true joints.
    """
    seen = joint_offsets(model, poses, joints, visible)
    fitted = joint_offsets(model, fit_poses(model, joints).poses, joints)
    often = visible.sum(axis=0) >= OFTEN * len(joints)
    return np.where(often[:, None], seen, fitted)
