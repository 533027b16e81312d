"""Losses of a track and the time to recovery."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from depthtrack.evaluation.metrics.metric import Metric
from depthtrack.recording.status import Status
from depthtrack.types import Array, Mask


@dataclass(frozen=True)
class Loss:
    """Consecutive frames without a trusted pose, after a frame with one.

    first: row of the first of them.
    frames: number of frames.
    seconds: time from the last trusted frame to the next one; None without a next one.
    seen: whether a hand was observed in any of the frames.
    """

    first: int
    frames: int
    seconds: float | None
    seen: bool


@dataclass(frozen=True)
class Losses:
    """Losses of a run, as the tracker reported them.

    lost: (T,) frames whose pose does not fit the observation.
    absent: (T,) frames without an observed hand.
    losses: losses in order of time.
    first_trusted: row of the first trusted pose; None without one.

    Ground truth is not used. Wrong poses that the tracker trusts are counted by the share of frames within 10 to 40 mm.
    """

    lost: Mask
    absent: Mask
    losses: tuple[Loss, ...]
    first_trusted: int | None

    @property
    def recovered(self) -> int:
        """Number of losses that ended."""
        return sum(loss.seconds is not None for loss in self.losses)

    def time_to_recovery(self) -> Metric:
        """Return the duration of each loss, s; NaN for a loss without end."""
        seconds = [np.nan if loss.seconds is None else loss.seconds for loss in self.losses]
        return Metric("time_to_recovery_s", "s", np.array(seconds, dtype=np.float64))

    def to_json(self) -> dict[str, Any]:
        """Return the counts and the statistics of the time to recovery as JSON values."""
        return {
            "lost_frames": int(self.lost.sum()),
            "absent_frames": int(self.absent.sum()),
            "losses": len(self.losses),
            "recovered": self.recovered,
            "time_to_recovery_s": self.time_to_recovery().statistics(),
        }


def find_losses(status: Sequence[Status], timestamps: Array) -> Losses:
    """Return the losses of a run.

    status: (T,).
    timestamps: (T,), s.
    """
    lost = np.array([s is Status.LOST for s in status], dtype=np.bool_)
    absent = np.array([s is Status.ABSENT for s in status], dtype=np.bool_)
    trusted = [row for row, s in enumerate(status) if s.is_trusted]
    ends = [*trusted[1:], None] if trusted else []
    losses = []
    for before, after in zip(trusted, ends, strict=True):
        end = len(status) if after is None else after
        if end > before + 1:
            seconds = None if after is None else float(timestamps[after] - timestamps[before])
            losses.append(Loss(before + 1, end - before - 1, seconds, bool(lost[before + 1 : end].any())))
    return Losses(lost, absent, tuple(losses), trusted[0] if trusted else None)
