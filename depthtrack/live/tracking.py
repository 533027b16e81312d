"""The loop of live tracking: one update for each frame that arrives, with its latency."""

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from depthtrack.api.live import HandTracker
from depthtrack.hand.one_euro import OneEuroFilter
from depthtrack.live.frames import LiveFrame
from depthtrack.tracking.tracker import Estimate
from depthtrack.types import Array


@dataclass(frozen=True)
class LiveEstimate:
    """A tracked frame of a live source.

    pose: (27,) of the estimate, filtered if a filter was given; None if no hand was observed.
    latency: seconds from the arrival of the frame to the pose.
    dropped: number of frames that were dropped since the one before.
    """

    frame: LiveFrame
    estimate: Estimate
    pose: Array | None
    latency: float
    dropped: int


def track_live(
    frames: Iterable[LiveFrame],
    tracker: HandTracker,
    *,
    smooth: OneEuroFilter | None = None,
    clock: Callable[[], float] = time.perf_counter,
) -> Iterator[LiveEstimate]:
    """Track frames as they arrive, by `HandTracker.update`.

    A frame that is not newer than the one before is dropped.

    smooth: filter of the poses; it delays motion.
    clock: the clock of the arrivals, seconds.

    Example:
        source = depthtrack.PlayedRecording(recording)
        with depthtrack.HandTracker(source.camera) as tracker:
            for each in depthtrack.track_live(source, tracker):
                print(each.estimate.status, each.latency)
    """
    last: LiveFrame | None = None
    for frame in frames:
        if last is not None and (frame.number <= last.number or frame.timestamp <= last.timestamp):
            continue
        estimate = tracker.update(frame.depth, frame.colour, timestamp=frame.timestamp)
        pose = estimate.pose if smooth is None else smooth.update(estimate.pose, frame.timestamp)
        dropped = 0 if last is None else frame.number - last.number - 1
        yield LiveEstimate(frame, estimate, pose, clock() - frame.arrival, dropped)
        last = frame


@dataclass
class LiveReport:
    """Figures of a live run.

    latencies: seconds, one a tracked frame.
    """

    latencies: list[float] = field(default_factory=list)
    dropped: int = 0
    trusted: int = 0

    def add(self, each: LiveEstimate) -> None:
        """Count a tracked frame."""
        self.latencies.append(each.latency)
        self.dropped += each.dropped
        self.trusted += each.estimate.status.is_trusted

    def to_fields(self) -> dict[str, Any]:
        """Return the figures as JSON values; latencies are None if no frame was tracked."""
        median, p95 = (1000 * np.percentile(self.latencies, [50, 95])).tolist() if self.latencies else (None, None)
        return {
            "frames": len(self.latencies),
            "dropped": self.dropped,
            "trusted": self.trusted,
            "latency_ms": {"median": median, "p95": p95},
        }

    def text(self) -> str:
        """Return the figures in one line."""
        fields = self.to_fields()
        if not self.latencies:
            return "no frame arrived"
        share = self.dropped / (self.dropped + len(self.latencies))
        latency = fields["latency_ms"]
        return (
            f"{fields['frames']} frames tracked, {self.dropped} dropped ({100 * share:.1f} %); "
            f"{self.trusted} with a trusted pose; "
            f"latency {latency['median']:.1f} ms (median), {latency['p95']:.1f} ms (95th percentile)"
        )
