"""Segmentation of a frame around the predicted pose, or the pose of a start."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from depthtrack.geometry.rotations import rotation_matrix
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import ORIENTATION, POSITION
from depthtrack.recording.frame_failures import failure_text
from depthtrack.recording.sequence import Frame
from depthtrack.recording.status import Status
from depthtrack.segmentation.hand_size import AVERAGE_HAND
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.roi_tracking import RoiPrior
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.segmentation.wrist import WristPlane
from depthtrack.tracking.keypoint_guide import KeypointGuide
from depthtrack.tracking.tracker import Estimate, Guide
from depthtrack.types import Array

_ELSEWHERE = 0.03
"""Metres between the palms of a start and of the observation from which on the start is at another place."""


def segment(
    frame: Frame,
    segmenter: Segmenter,
    model: HandModel,
    guide: Guide,
    keypoints: KeypointGuide,
    clock: Callable[[], float],
) -> tuple[Observation | None, float, str | None]:
    """Return the observation of a frame, the time in milliseconds, and an unexpected failure.

    It is near the prediction, else near the keypoints of the frame. If no hand is found, it is near
    a track in doubt.
    """
    begun, observation, failure = clock(), None, None
    try:
        pose = guide.predicted_pose(frame.timestamp)
        prior = roi_prior(model, keypoints.pose(frame) if pose is None else pose)
        observation = segment_start(frame, segmenter, model) if prior is None else segmenter.segment(frame, prior)
        if observation is None and (doubted := roi_prior(model, guide.doubted_pose(frame.timestamp))) is not None:
            observation = segmenter.segment(frame, doubted)
    except Exception as error:
        failure = failure_of(error)
    if observation is not None:
        observation = observation.arrived_at(begun)
    return observation, 1e3 * (clock() - begun), failure


@dataclass(frozen=True)
class _Resegmentation:
    """Segments the frame of a start anew, see `Resegmentation`.

    first: the observation without a prior.
    """

    frame: Frame
    first: Observation
    segmenter: Segmenter
    model: HandModel

    def elsewhere(self) -> Iterator[Observation]:
        return self.segmenter.alternatives(self.frame, self.first)

    def around(self, pose: Array) -> Observation | None:
        prior = roi_prior(self.model, pose)
        return None if prior is None else self.segmenter.around(self.frame, prior)


def segment_start(frame: Frame, segmenter: Segmenter, model: HandModel) -> Observation | None:
    """Return the observation of a frame without a prior; None without a hand.

    It can be segmented anew.
    """
    first = segmenter.segment(frame, None)
    if first is None:
        return None
    return replace(first, resegmentation=_Resegmentation(frame, first, segmenter, model))


def around_start(
    frame: Frame, observation: Observation | None, estimate: Estimate, segmenter: Segmenter, model: HandModel
) -> tuple[Observation | None, str | None]:
    """Return the observation of a frame after its estimate, and an unexpected failure.

    It cannot be segmented anew any more.

    A start elsewhere than the observed palm has chosen another place: the frame is segmented again around its pose.
    """
    if observation is None or observation.resegmentation is None:
        return observation, None
    if estimate.status is Status.STARTED and estimate.pose is not None:
        apart = float(np.linalg.norm(estimate.pose[POSITION] - observation.centre))
        if apart > _ELSEWHERE:
            try:
                return segmenter.segment(frame, roi_prior(model, estimate.pose)), None
            except Exception as error:
                return replace(observation, resegmentation=None), failure_of(error)
    return replace(observation, resegmentation=None), None


def roi_prior(model: HandModel, pose: Array | None) -> RoiPrior | None:
    """Return the ROI prior of a hand in `pose` (27,); None without a pose.

    Only the reach is the hand's own. With the palm sizes of a calibrated hand the IK tracker lost 22 of 1600 frames of
    a real recording, with average sizes 3.
    """
    if pose is None:
        return None
    wrist = WristPlane(model.wrist(pose), -rotation_matrix(pose[ORIENTATION])[:, 1])
    return RoiPrior(pose[POSITION].copy(), wrist, replace(AVERAGE_HAND, reach=model.reach))


def failure_of(error: Exception) -> str:
    """Return one line on an unexpected error inside a frame.

    Raises:
        Exception: the error itself, if no frame is its cause, such as a file that cannot be read.
    """
    if (text := failure_text(error)) is None:
        raise error
    return text
