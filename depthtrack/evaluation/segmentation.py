"""How well the hand is cut out of a recording, frame by frame."""

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from depthtrack.evaluation.metrics import silhouette_iou
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.recording.sequence import Frame, Sequence
from depthtrack.segmentation.observation import Observation, Segmenter
from depthtrack.tracking.pipeline import follow, roi_prior
from depthtrack.tracking.tracker import Tracker
from depthtrack.types import Mask


@dataclass(frozen=True)
class SegmentedFrame:
    """One frame's result. `mask` (h, w) covers the whole frame, None where no hand was found; `iou` with the true
    silhouette, None where that is not known; `ms` milliseconds to observe the frame, point cloud included."""

    frame: Frame
    observation: Observation | None
    mask: Mask | None
    iou: float | None
    ms: float

    def row(self) -> dict[str, Any]:
        """Figures for a table; centre in metres, area in pixels."""
        x, y, z = (None,) * 3 if self.observation is None else (float(c) for c in self.observation.centre)
        return {
            "index": self.frame.index,
            "timestamp": self.frame.timestamp,
            "found": self.mask is not None,
            "centre_x": x,
            "centre_y": y,
            "centre_z": z,
            "area_px": 0 if self.mask is None else int(self.mask.sum()),
            "iou": self.iou,
            "ms": round(self.ms, 3),
        }


def segment_sequence(
    sequence: Sequence, segmenter: Segmenter, tracker: Tracker | None = None, hand: HandShape | None = None
) -> Iterator[SegmentedFrame]:
    """Observe every frame of a recording, in order.

    With a `tracker` of a `hand` (the average adult's unless given), it tells the observer where to look while its track
    is sure, as it does when a recording is tracked; its own time does not count.
    """
    model = HandModel(hand or HandShape())
    for frame in sequence:
        place = None if tracker is None else roi_prior(model, tracker.predicted_pose)
        begun = time.perf_counter()
        observation = segmenter.segment(frame, place)
        if observation is not None:
            observation.points  # noqa: B018 (the cloud belongs to the observation's cost)
        ms = 1e3 * (time.perf_counter() - begun)
        if tracker is not None:
            follow(tracker, observation)
        mask = None if observation is None else observation.whole_mask(frame.depth.shape)
        truth = sequence.hand_mask(frame.index)
        found = np.zeros(frame.depth.shape, dtype=np.bool_) if mask is None else mask
        yield SegmentedFrame(frame, observation, mask, None if truth is None else silhouette_iou(found, truth), ms)


def summary(rows: Iterable[dict[str, Any]]) -> dict[str, Any]:
    """From the frames' rows: mean IoU (None where no truth is known), frames with a hand, milliseconds a frame."""
    rows = list(rows)
    ious, times = [row["iou"] for row in rows if row["iou"] is not None], [row["ms"] for row in rows]
    return {
        "frames": len(rows),
        "frames_with_hand": sum(row["found"] for row in rows),
        "mean_iou": float(np.mean(ious)) if ious else None,
        "ms_per_frame": {"median": float(np.median(times)), "p95": float(np.percentile(times, 95))} if rows else None,
    }
