"""A labelled capture with its gaps filled, how each sample was filled, and its error."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.types import Array, Index, Mask


class Filling(IntEnum):
    """How a sample came about.

    MEASURED: the measuring system saw the marker.
    GAP: it did not, and the sample stays missing.
    KINEMATIC: the visible markers determine the joints that move the marker (Maycock et al. 2015, Sec. III-C).
    INTERPOLATED: the joints that move the marker are interpolated between the ends of the gap (Sec. III-C).
    SMOOTHED: the posture is the likeliest one given the visible markers and the motion of this capture.
    SPLINE, PATTERN, PCA: the baselines of these names.
    REPLACED: the system saw a point, but not where the hand can have the marker. Interpolated.
    """

    MEASURED = 0
    GAP = 1
    KINEMATIC = 2
    INTERPOLATED = 3
    SMOOTHED = 4
    SPLINE = 5
    PATTERN = 6
    PCA = 7
    REPLACED = 8

    @property
    def word(self) -> str:
        """Return the name in files and tables."""
        return self.name.lower()


class Gap(NamedTuple):
    """Frames `start` to `stop` - 1 without marker `marker` of model `model`."""

    model: int
    marker: int
    start: int
    stop: int

    @property
    def length(self) -> int:
        """Return the number of frames."""
        return self.stop - self.start


@dataclass(frozen=True, eq=False)
class FilledCapture:
    """A labelled capture with filled gaps. The tuples have an entry for each model.

    positions: (T, M, 3) metres, capture frame; NaN where a gap stays.
    how: (T, M) `Filling` of each sample.
    expected_error: (T, M) metres, root mean square distance from the true position; NaN unless filled.
    poses: (T, 27) capture frame; those of filled frames are of the smoothed motion, near the filled positions.
    """

    labelled: LabelledCapture
    positions: tuple[Array, ...]
    how: tuple[Index, ...]
    expected_error: tuple[Array, ...]
    poses: tuple[Array, ...]

    def gaps(self) -> tuple[Gap, ...]:
        """Return all gaps of the labelled capture, filled or not, by model, marker and time."""
        return tuple(
            gap for k, how in enumerate(self.how) for gap in gaps_of(k, (how == Filling.MEASURED) | _replaced(how))
        )

    def is_filled(self, gap: Gap) -> bool:
        """Return whether every sample of a gap has a position."""
        return bool(np.isfinite(self.positions[gap.model][gap.start : gap.stop, gap.marker]).all())

    def capture(self) -> MarkerCapture:
        """Return the filled trajectories, labelled as `LabelledCapture.labelled` does."""
        measured = self.labelled.labelled()
        return replace(measured, positions=np.concatenate(self.positions, axis=1))


def gaps_of(model: int, measured: Mask) -> Iterator[Gap]:
    """Yield the gaps of a model's markers, by marker and time.

    measured: (T, M) whether a marker was measured.
    """
    for marker in range(measured.shape[1]):
        for start, stop in runs(~measured[:, marker]):
            yield Gap(model, marker, start, stop)


def measured_samples(positions: Array) -> Mask:
    """Return which positions (..., 3) are finite (...)."""
    return np.asarray(np.isfinite(positions).all(axis=-1))


def runs(mask: Mask) -> list[tuple[int, int]]:
    """Return first and one past the last element of every run of a mask (T,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(start), int(stop)) for start, stop in edges.reshape(-1, 2)]


def _replaced(how: Index) -> Mask:
    return np.asarray(how == Filling.REPLACED)
