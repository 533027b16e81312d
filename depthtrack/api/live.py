"""Track frames that come from any source, one call per frame."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthtrack.api.choices import Hand, as_config, open_hand
from depthtrack.calibration.calibrate import Measured
from depthtrack.calibration.ongoing_pipeline import OngoingPipeline
from depthtrack.closing import Closing
from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.machine import usable_cores
from depthtrack.recording.sequence import Frame, ImageKeypoints
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.tracking.configuration import DEFAULT_TRACKER, HybridConfig, IkConfig, TrackerConfig
from depthtrack.tracking.pipeline import Pipeline, TrackedFrame
from depthtrack.tracking.random import checked_pose
from depthtrack.tracking.registry import create_tracker
from depthtrack.tracking.tracker import Estimate, Tracker
from depthtrack.types import Array, Depth, Image


class HandTracker(Closing):
    """Tracks a hand in frames that come from any source: a sensor, a network, a program.

    Searches end at a deadline, and go on in the next frames. Without a deadline, equal frames give equal bits; with a
    given hand, all frames of a recording then give the poses that `depthtrack track` writes. Without a hand, it is
    measured while it is tracked: the average adult's hands of both sides are tracked first, then those of the sizes so
    far. The size of the whole hand is known after it was visible for 1.5 seconds, all sizes two seconds later. They are
    measured again every two seconds, and less often when they stay. `depthtrack track` measures the hand before it
    tracks the first frame.
    Frames are numbered from 0 as they arrive; the random numbers of a frame depend on its number.
    The segmentation uses colour if the first frame has colour.

    Example:
        with depthtrack.HandTracker(camera, tracker="ik") as tracker:
            for depth, colour, seconds in sensor:
                estimate = tracker.update(depth, colour, timestamp=seconds)
                if estimate.status.is_trusted:
                    print(tracker.keypoints(estimate))
    """

    def __init__(
        self,
        camera: Camera,
        hand: Hand = None,
        tracker: str | TrackerConfig | Tracker = DEFAULT_TRACKER,
        *,
        segmentation: SegmentationOptions | None = None,
        start_pose: ArrayLike | None = None,
        threads: int | None = None,
        deadline: float | None = 33.0,
    ) -> None:
        """Make a tracker for the frames of one camera.

        hand: a hand, the path of a hand file or rigged mesh, or "average" for the average adult's right hand. If
            absent, its side and sizes are measured while it is tracked.
        tracker: name or configuration of a tracker, or a tracker of your own, made for the same hand. Its hand stays,
            the average one if `hand` is absent.
        segmentation: how the hand is found in a frame.
        start_pose: (27,) pose in the first frame, metres, quaternion and radians, camera frame; searched if absent.
        threads: threads of renderer and fits, one per core if absent; poses do not depend on it.
        deadline: milliseconds after the call of `update` at which its searches end; None for none. A configuration
            states its own.

        Raises:
            InputError: there is no such tracker, or a file cannot be read.
        """
        self.camera, self._given, self._segmentation = camera, open_hand(hand), segmentation or SegmentationOptions()
        self._start_pose = None if start_pose is None else checked_pose(start_pose)
        self._tracker: Tracker | OngoingPipeline
        if isinstance(tracker, str | TrackerConfig):
            config = as_config(tracker)
            if isinstance(tracker, str) and isinstance(config, HybridConfig | IkConfig):
                config = replace(config, deadline=deadline)
            make = partial(create_tracker, config, threads=threads or usable_cores())
            measured = hand is None
            waits = getattr(config, "deadline", None) is None
            self._tracker = (
                OngoingPipeline(make, self._segmenter, self._start_pose, waits=waits) if measured else make(self._given)
            )
        else:
            self._tracker = tracker
        self._pipeline: Pipeline | OngoingPipeline | None = None
        self._last: TrackedFrame | None = None
        self._closed = False

    def update(
        self,
        depth: NDArray[Any],
        colour: Image | None = None,
        *,
        timestamp: float,
        keypoints: ImageKeypoints | ArrayLike | None = None,
    ) -> Estimate:
        """Track the hand into the next frame. An array that needs no conversion is not copied.

        depth: (h, w) along the optical axis; floats in metres, or uint16 in units of `camera.depth_scale`; 0 = none.
        colour: (h, w, 3) uint8 RGB registered to the depth.
        timestamp: seconds on any clock, later than that of the frame before.
        keypoints: from another detector, in MediaPipe's order: (21, 3) column and row in the depth image, pixels, and
            confidence, 0 to 1. Those with NaN are unknown.

        Returns:
            The estimate; its `pose` (27,) is None if no hand was observed.

        Raises:
            InputError: an array has the wrong shape or type, depth is negative or not finite, or time stands still.
        """
        if self._closed:
            raise InputError("the tracker must be open to track a frame, found it closed: make a new one")
        last = self._last
        frame = Frame(
            0 if last is None else last.frame.index + 1,
            _checked_time(timestamp, None if last is None else last.frame.timestamp),
            _checked_depth(depth, self.camera),
            None if colour is None else _checked_colour(colour, self.camera),
            self.camera,
            None if keypoints is None else _checked_keypoints(keypoints),
        )
        if self._pipeline is None:
            self._pipeline = self._pipeline_for(frame)
        self._last = self._pipeline.step(frame)
        return self._last.estimate

    def keypoints(self, estimate: Estimate) -> Array:
        """Return the keypoints (21, 3) of an estimate, metres, camera frame, in MediaPipe's order.

        They are those of the hand that the estimate was made with, and NaN if the estimate has no pose.
        """
        if estimate.pose is None:
            return np.full((21, 3), np.nan)
        return HandModel(estimate.hand or self._given).keypoints(estimate.pose)

    @property
    def hand(self) -> HandShape:
        """The given hand, or the measured one so far."""
        return self._tracker.hand if isinstance(self._tracker, OngoingPipeline) else self._given

    @property
    def side_sure(self) -> bool:
        """Whether the side was given, or the hand of the other side fits clearly worse."""
        return not isinstance(self._tracker, OngoingPipeline) or self._tracker.side_sure

    @property
    def measured(self) -> dict[str, Measured]:
        """Each measured length and width by name; empty if none was measured so far."""
        return self._tracker.measured if isinstance(self._tracker, OngoingPipeline) else {}

    @property
    def last(self) -> TrackedFrame | None:
        """The last frame with its observation and estimate; None before the first one."""
        return self._last

    @property
    def observation(self) -> Observation | None:
        """The hand that was segmented in the last frame; None if none was found."""
        return None if self._last is None else self._last.observation

    def close(self) -> None:
        """Free the tracker."""
        if not self._closed:
            self._closed = True
            self._tracker.close()

    def _pipeline_for(self, first: Frame) -> Pipeline | OngoingPipeline:
        """Return the pipeline for frames like the first one."""
        if isinstance(self._tracker, OngoingPipeline):
            return self._tracker
        return Pipeline(self._tracker, self._segmenter(first), self._given, self._start_pose)

    def _segmenter(self, frame: Frame) -> Segmenter:
        """Return a segmenter that uses colour if the frame has it."""
        return Segmenter.from_options(self._segmentation, has_colour=frame.colour is not None)


def _checked_time(timestamp: float, last: float | None) -> float:
    """Return the time, seconds. Raises InputError unless it is finite and after `last`."""
    time = float(timestamp)
    if not np.isfinite(time):
        raise InputError(f"the timestamp must be finite seconds, found {time}")
    if last is not None and time <= last:
        raise InputError(f"timestamps must increase: expected more than {last:g} s, found {time:g} s")
    return time


def _checked_depth(depth: NDArray[Any], camera: Camera) -> Depth:
    """Return the depth (h, w) in metres. Raises InputError for a wrong shape, type or value."""
    depth = np.asarray(depth)
    if depth.shape != camera.shape:
        raise InputError(f"depth must have the camera's shape {camera.shape} (height, width), found {depth.shape}")
    if depth.dtype == np.uint16:
        return camera.metres(depth)
    if not np.issubdtype(depth.dtype, np.floating):
        raise InputError(f"depth must be floats in metres or uint16 in units of depth_scale, found {depth.dtype}")
    metres: Depth = np.ascontiguousarray(depth, dtype=np.float32)
    if not (metres.min() >= 0 and metres.max() < np.inf):  # false for NaN
        raise InputError("depth must be finite and not negative, found other values: set missing readings to 0")
    return metres


def _checked_colour(colour: Image, camera: Camera) -> Image:
    """Return the colour image (h, w, 3). Raises InputError if its shape or type is wrong."""
    colour = np.asarray(colour)
    if colour.shape != (*camera.shape, 3) or colour.dtype != np.uint8:
        expected = (*camera.shape, 3)
        raise InputError(f"colour must be uint8 RGB of shape {expected}, found {colour.dtype} of {colour.shape}")
    return np.ascontiguousarray(colour)


def _checked_keypoints(keypoints: ImageKeypoints | ArrayLike) -> ImageKeypoints:
    """Return the keypoints. Raises InputError if their shape or a confidence is wrong."""
    if isinstance(keypoints, ImageKeypoints):
        parts = np.asarray(keypoints.pixels), np.asarray(keypoints.confidence)
        if (parts[0].shape, parts[1].shape) != ((21, 2), (21,)):
            raise InputError(f"keypoints must be (21, 2) pixels and (21,) confidences, found {parts[0].shape}")
        rows, side = np.column_stack(parts), keypoints.side
    else:
        rows, side = np.asarray(keypoints, dtype=np.float64), None
    if rows.shape != (21, 3):
        raise InputError(f"keypoints must be x, y and confidence of 21 points, found shape {rows.shape}")
    known = np.asarray(np.isfinite(rows).all(axis=1))
    if np.any((rows[known, 2] < 0) | (rows[known, 2] > 1)):
        raise InputError("the confidence of keypoints must lie between 0 and 1, found other values")
    return ImageKeypoints(np.where(known[:, None], rows[:, :2], np.nan), np.where(known, rows[:, 2], 0.0), side)
