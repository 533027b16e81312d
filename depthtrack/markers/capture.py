"""An optical marker capture: trajectories of points, labelled or not."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from depthtrack.types import Array, Index, Mask

UNLABELLED = "*"
"""First character of the label of an unlabelled trajectory, as in C3D files."""


@dataclass(frozen=True)
class MarkerCapture:
    """T frames of M trajectories.

    rate: frames a second, Hz.
    labels: (M,) all different; that of an unlabelled trajectory begins with `*`.
    positions: (T, M, 3) metres, capture frame; NaN where a point was not measured.
    residuals: (T, M) metres, of the measuring system; None if the file states none.
    first_frame: number of the first frame in the file.
    notes: what reading the file changed or assumed, a sentence each.
    unit: length unit of the file, "m", "cm" or "mm"; that of `positions` is the metre.
    """

    rate: float
    labels: tuple[str, ...]
    positions: Array
    residuals: Array | None = None
    first_frame: int = 1
    notes: tuple[str, ...] = ()
    unit: str = "m"

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.positions)

    @cached_property
    def times(self) -> Array:
        """The time (T,) of each frame, seconds; the first one is 0."""
        return np.arange(len(self)) / self.rate

    @cached_property
    def is_labelled(self) -> Mask:
        """Whether each trajectory (M,) has a label."""
        return np.array([not label.startswith(UNLABELLED) for label in self.labels], dtype=np.bool_)

    def points(self, frame: int) -> tuple[Array, Index]:
        """Return the measured points (K, 3) of a frame, metres, and their columns (K,)."""
        columns = np.flatnonzero(np.isfinite(self.positions[frame]).all(axis=-1))
        return self.positions[frame, columns], columns

    def between(self, start: int, stop: int) -> "MarkerCapture":
        """Return the frames from index `start` up to, but not including, `stop`."""
        residuals = None if self.residuals is None else self.residuals[start:stop]
        first = self.first_frame + start
        return replace(self, positions=self.positions[start:stop], residuals=residuals, first_frame=first)

    def selected(self, labels: tuple[str, ...]) -> "MarkerCapture":
        """Return the capture of some trajectories, in this order. Raises KeyError if one is missing."""
        column = {label: k for k, label in enumerate(self.labels)}
        chosen = [column[label] for label in labels]
        residuals = None if self.residuals is None else self.residuals[:, chosen]
        return replace(self, labels=labels, positions=self.positions[:, chosen], residuals=residuals)
