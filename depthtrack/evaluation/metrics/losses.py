"""When a track was lost, and how long it took to find the hand again."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from depthtrack.evaluation.metrics.metric import Metric
from depthtrack.recording.status import Status
from depthtrack.types import Array, Mask


@dataclass(frozen=True)
class Loss:
    """An unbroken stretch of frames without a trusted pose, after one that had it.

    `first` row of the run, `frames` how many; `seconds` from the last trusted frame to the next one, None where the
    hand was not found again. `seen` says whether a hand was observed in any of the frames: else it had gone.
    """

    first: int
    frames: int
    seconds: float | None
    seen: bool


@dataclass(frozen=True)
class Losses:
    """`lost` (T,) frames whose pose does not explain the observation, `absent` (T,) those without any observed hand;
    `losses` in order; `first_trusted` row, before which the track had not begun (None: it never did).

    The tracker itself says so, from the recording alone: a track that is wrong and sure of it is not counted here, but
    by the share of frames within 10 to 40 mm.
    """

    lost: Mask
    absent: Mask
    losses: tuple[Loss, ...]
    first_trusted: int | None

    @property
    def recovered(self) -> int:
        """How many losses ended."""
        return sum(loss.seconds is not None for loss in self.losses)

    def time_to_recovery(self) -> Metric:
        """Seconds of every loss, in place of frames; NaN for one without end."""
        seconds = [np.nan if loss.seconds is None else loss.seconds for loss in self.losses]
        return Metric("time_to_recovery_s", "s", np.array(seconds, dtype=np.float64))

    def to_json(self) -> dict[str, Any]:
        """Counts and the statistics of the time to recovery."""
        return {
            "lost_frames": int(self.lost.sum()),
            "absent_frames": int(self.absent.sum()),
            "losses": len(self.losses),
            "recovered": self.recovered,
            "time_to_recovery_s": self.time_to_recovery().statistics(),
        }


def find_losses(status: Sequence[Status], timestamps: Array) -> Losses:
    """The losses of a run with a `status` (T,) at each of `timestamps` (T,), seconds."""
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
