"""The interactive viewer of live tracking: the frame, the hand and the latency as they come.

It needs the extra `view` (rerun-sdk).
"""

import importlib
from dataclasses import dataclass
from typing import Any

from depthtrack.recording.status import Status
from depthtrack.viewing.annotated_frame import AnnotatedFrame
from depthtrack.viewing.rerun_viewer import FLAT_IMAGES, AnnotatedFrameStream
from depthtrack.viewing.theme import STATUS_COLOURS


@dataclass(frozen=True)
class LiveMoment:
    """A tracked frame to show.

    latency: from the arrival of the frame to its pose, s.
    dropped: number of frames that were dropped before it.
    """

    annotated: AnnotatedFrame
    status: Status
    latency: float
    dropped: int


class RerunLiveViewer(AnnotatedFrameStream[LiveMoment]):
    """Viewer of live tracking.

    Entities, in addition to those of recordings: `live/latency_ms`, `live/dropped` and `live/status` over time.
    """

    def log(self, item: LiveMoment) -> None:
        """See `RerunStream`."""
        rr, stream = self._rr, self._stream
        self.log_annotated(item.annotated)
        stream.log("live/latency_ms", rr.Scalars(1000 * item.latency))
        stream.log("live/dropped", rr.Scalars(float(item.dropped)))
        text = f"frame {item.annotated.frame.index}: {item.status}"
        stream.log("live/status", rr.TextLog(text, color=STATUS_COLOURS[item.status]))

    def _layout(self) -> Any:
        rrb = importlib.import_module("rerun.blueprint")
        images = rrb.Vertical(
            self._image("hand", "depth_picture", "colour", "mask", "skeleton"),
            self._image("depth", "depth", "depth_picture", "skeleton"),
        )
        numbers = rrb.Vertical(
            rrb.TimeSeriesView(origin="live/latency_ms", name="latency, ms"),
            rrb.TimeSeriesView(origin="live/dropped", name="dropped frames"),
            rrb.TextLogView(origin="live/status", name="status"),
        )
        return self._blueprint(rrb.Horizontal(self._scene(FLAT_IMAGES), images, numbers, column_shares=[3, 3, 2]))
