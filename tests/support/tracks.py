"""Tracks of poses to export, without a run folder."""

import numpy as np

from depthtrack.export.joint_track import JointTrack
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.pose import make_pose
from depthtrack.hand.shape import HandShape
from depthtrack.recording.status import Status
from depthtrack.types import Array


def moving_poses(frames: int, seed: int = 0) -> Array:
    """Return poses (T, 27) of a hand that turns and bends its fingers smoothly."""
    random = np.random.default_rng(seed)
    time = np.linspace(0, 1, frames)[:, None]
    phase, share = random.uniform(0, 2 * np.pi, 20), random.uniform(0.3, 0.9, 20)
    angles = LOWER + (UPPER - LOWER) * (0.5 + 0.5 * share * np.sin(3 * time + phase))
    turn = np.concatenate([np.cos(2 * time), np.sin(2 * time) * [[0.6, 0.64, -0.48]]], axis=1)
    return make_pose(np.array([0.05, -0.1, 0.5]) + 0.1 * np.sin(2 * time + [0, 1, 2]), turn, angles)


def track_of(poses: Array, hand: HandShape | None = None, start: float = 0.0, rate: float = 30.0) -> JointTrack:
    """Return the track of poses (T, 27), NaN where absent."""
    frames, hand = len(poses), hand or HandShape()
    seen = np.asarray(np.isfinite(poses).all(axis=1))
    keypoints = np.full((frames, 21, 3), np.nan)
    keypoints[seen] = HandModel(hand).keypoints(poses[seen])
    figures = np.where(seen, 0.9, np.nan)
    return JointTrack(
        index=np.arange(frames),
        timestamps=start + np.arange(frames) / rate,
        status=tuple(Status.TRACKED if each else Status.ABSENT for each in seen),
        energy=figures,
        agreement=figures,
        confidence=figures,
        visibility=np.ones((frames, 5)),
        spread=np.full((frames, 21), 0.005),
        poses=poses,
        keypoints=keypoints,
        hand=hand,
    )
