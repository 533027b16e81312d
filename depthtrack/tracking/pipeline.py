"""The loop over a recording: observe, start or follow, write down; takes up an interrupted run where it stood."""

import time
from collections.abc import Callable, Iterator
from itertools import islice

import numpy as np

from depthtrack.geometry.rotations import rotation_matrix
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import ORIENTATION, POSITION
from depthtrack.recording.run_folder import RunRow, RunWriter
from depthtrack.recording.sequence import Sequence
from depthtrack.segmentation.observation import Observation, Segmenter
from depthtrack.segmentation.roi_tracking import RoiPrior
from depthtrack.segmentation.wrist import WristPlane
from depthtrack.tracking.tracker import ABSENT, Estimate, Tracker
from depthtrack.types import Array

_REACH_MARGIN = 0.03
"""Metres that a hand may have moved since it was last seen, beyond its prediction."""


def track_sequence(
    sequence: Sequence,
    segmenter: Segmenter,
    tracker: Tracker,
    model: HandModel,
    run: RunWriter,
    start_pose: np.ndarray | None = None,
    count: int | None = None,
    clock: Callable[[], float] = time.perf_counter,
) -> Iterator[RunRow]:
    """Track every frame, or the first `count` of them, and append it to the run; yields each row as it is done.

    While the track is sure, the tracker tells the observer where to look. Frames that the run already
    holds are observed again, which costs little and brings the observer to where it was, but not tracked again.
    `start_pose` (27,) is refined on the first frame with a hand; without it the tracker
    starts by itself. `clock` (seconds) times the observer.
    """
    done = list(run.rows)
    awaiting_start = start_pose is not None and all(row.pose is None for row in done)
    for number, frame in enumerate(islice(sequence, count)):
        begun = clock()
        observation = segmenter.segment(frame, roi_prior(model, tracker.predicted_pose))
        observe_ms = 1e3 * (clock() - begun)
        if number < len(done):
            tracker.restore([_estimate(done[number])])
            continue
        if observation is not None and awaiting_start:
            estimate, awaiting_start = tracker.start(observation, start_pose), False
        else:
            estimate = follow(tracker, observation)
        row = RunRow(frame.index, frame.timestamp, estimate.status, estimate.energy, estimate.confidence, estimate.pose)
        run.append(row, {"segment": observe_ms, **estimate.stage_ms})
        yield row


def follow(tracker: Tracker, observation: Observation | None) -> Estimate:
    """One frame on; a tracker that is shown no hand remembers that there was none."""
    if observation is not None:
        return tracker.track(observation)
    tracker.restore([ABSENT])
    return ABSENT


def roi_prior(model: HandModel, pose: Array | None) -> RoiPrior | None:
    """Where a hand in this pose is: around its palm, as far as its fingers reach, up to its wrist."""
    if pose is None:
        return None
    shape = model.shape
    max_distance = (np.linalg.norm(shape.bases, axis=1) + shape.lengths.sum(axis=1)).max() * shape.scale + _REACH_MARGIN
    wrist = WristPlane(model.wrist(pose), -rotation_matrix(pose[ORIENTATION])[:, 1])
    return RoiPrior(pose[POSITION].copy(), float(max_distance), wrist)


def _estimate(row: RunRow) -> Estimate:
    return Estimate(row.pose, row.energy, row.confidence, row.status)
