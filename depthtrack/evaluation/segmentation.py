"""Evaluate the segmentation of a recording, frame by frame."""

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from depthtrack.evaluation.metrics import silhouette_iou
from depthtrack.hand.shape import HandShape
from depthtrack.recording.sequence import Frame, Sequence
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.tracking.pipeline import NoTracker, Pipeline, track_frames
from depthtrack.tracking.tracker import Tracker
from depthtrack.types import Mask


@dataclass(frozen=True)
class SegmentedFrame:
    """Segmentation of one frame.

    mask: (h, w) of the whole frame; None without a hand.
    iou: IoU with the true silhouette; None if that is unknown.
    ms: milliseconds to segment the frame, including the point cloud.
    """

    frame: Frame
    observation: Observation | None
    mask: Mask | None
    iou: float | None
    ms: float

    @property
    def occluder(self) -> Mask | None:
        """The object (h, w) of the whole frame that may hide the hand; None without any."""
        return None if self.observation is None else self.observation.whole_occluder(self.frame.depth.shape)

    def row(self) -> dict[str, Any]:
        """Return the columns of a table: centre in metres, area in pixels."""
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
    """Yield every frame of a recording with its segmentation.

    tracker: tracker of `hand` whose predictions guide the segmentation; its own time is left out.
    """
    pipeline = Pipeline(tracker or NoTracker(), segmenter, hand or HandShape())
    for each in track_frames(sequence, pipeline):
        begun = time.perf_counter()
        if each.observation is not None:
            each.observation.points  # noqa: B018 (computes the point cloud, which the time includes)
        ms = each.segment_ms + 1e3 * (time.perf_counter() - begun)
        shape = each.frame.depth.shape
        mask = None if each.observation is None else each.observation.whole_mask(shape)
        truth = sequence.hand_mask(each.frame.index)
        found = np.zeros(shape, dtype=np.bool_) if mask is None else mask
        iou = None if truth is None else silhouette_iou(found, truth)
        yield SegmentedFrame(each.frame, each.observation, mask, iou, ms)


def summary(rows: Iterable[dict[str, Any]]) -> dict[str, Any]:
    """Return the frames, those with a hand, the mean IoU and the milliseconds per frame.

    rows: rows of the frames, as `SegmentedFrame.row` returns them.

    The mean IoU is None without true silhouettes.
    """
    rows = list(rows)
    ious, times = [row["iou"] for row in rows if row["iou"] is not None], [row["ms"] for row in rows]
    return {
        "frames": len(rows),
        "frames_with_hand": sum(row["found"] for row in rows),
        "mean_iou": float(np.mean(ious)) if ious else None,
        "ms_per_frame": {"median": float(np.median(times)), "p95": float(np.percentile(times, 95))} if rows else None,
    }
