"""The poses and keypoints of a run, for export."""

from dataclasses import dataclass, replace
from typing import Literal, Self

import numpy as np

from depthtrack.errors import InputError
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.one_euro import OneEuroOptions, smooth
from depthtrack.hand.shape import HandShape
from depthtrack.recording.run_folder import Run
from depthtrack.recording.status import Status
from depthtrack.types import Array, Index, Mask


@dataclass(frozen=True)
class JointTrack:
    """Poses and keypoints of T frames, NaN if no hand was observed.

    index: (T,) frame of the recording.
    timestamps: (T,) seconds.
    status: (T,) result of each frame.
    energy, agreement, confidence: (T,) of the poses, see `RunRow`.
    visibility: (T, 5) share of each finger that is visible.
    spread: (T, 21) of the keypoints, metres, see `RunRow`.
    poses: (T, 27) metres, quaternion, radians.
    keypoints: (T, 21, 3) metres, in MediaPipe's order.
    hand: the hand of the poses.
    frame: "camera" if poses and keypoints are in the camera frame, "capture" if in that of a capture of markers.
    """

    index: Index
    timestamps: Array
    status: tuple[Status, ...]
    energy: Array
    agreement: Array
    confidence: Array
    visibility: Array
    spread: Array
    poses: Array
    keypoints: Array
    hand: HandShape
    frame: Literal["camera", "capture"] = "camera"

    @classmethod
    def of(cls, run: Run, hand: HandShape) -> Self:
        """Return the poses of a run with the keypoints of its hand."""
        keypoints = HandModel(hand).keypoints(run.poses)
        figures = (run.energy, run.agreement, run.confidence, run.visibility, run.spread)
        frame: Literal["camera", "capture"] = "capture" if run.configuration.get("tracker") == "markers" else "camera"
        return cls(run.index, run.timestamps, run.status, *figures, run.poses, keypoints, hand, frame)

    def smoothed(self, options: OneEuroOptions | None = None) -> tuple[Self, Array]:
        """Return the track with poses and keypoints of a one-euro filter, and its delays.

        The delays (T, 3) are those of position, orientation and finger angles, s; see `OneEuroFilter`.
        """
        poses, delays = smooth(self.poses, self.timestamps, options)
        keypoints = HandModel(self.hand).keypoints(poses)
        return replace(self, poses=poses, keypoints=keypoints), delays

    @property
    def posed(self) -> Mask:
        """Whether each frame (T,) has a pose."""
        return np.asarray(np.isfinite(self.poses).all(axis=1))

    def check_posed(self) -> None:
        """Raise InputError if no frame has a pose."""
        if not self.posed.any():
            raise InputError("no frame of the run has a pose: there is nothing to export in this format")
