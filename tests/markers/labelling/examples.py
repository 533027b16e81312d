"""Captures with truth for the tests of the labelling."""

from dataclasses import dataclass

import numpy as np

from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.synthesis.marker_capture import MarkerSynthesis, synthesise_markers
from depthtrack.synthesis.marker_measurement import MeasurementErrors
from depthtrack.types import Array, Index

CLEAN = MeasurementErrors(noise=0.0002, dropouts=0.0, ghosts=0)
USUAL = MeasurementErrors(noise=0.0005, dropouts=0.05, ghosts=2)


@dataclass(frozen=True)
class Example:
    """A shuffled capture, its models, their true poses (T, 27) and columns (T, M)."""

    capture: MarkerCapture
    models: tuple[MarkerModel, ...]
    poses: tuple[Array, ...]
    columns: tuple[Index, ...]

    @property
    def starts(self) -> list[Array]:
        """The true poses (27,) of the first frame."""
        return [poses[0] for poses in self.poses]

    def right(self, columns: tuple[Index, ...]) -> float:
        """Return the share of the measured markers that have their true label."""
        true, found = np.concatenate(self.columns, axis=1), np.concatenate(columns, axis=1)
        return float(np.mean((true == found)[true >= 0]))


def example(frames: int, errors: MeasurementErrors = CLEAN, **options: object) -> Example:
    """Return a synthetic capture of the everyday motion from its tenth second on."""
    made = synthesise_markers(MarkerSynthesis(frames=frames, errors=errors, start=10.0, seed=3, **options))  # type: ignore[arg-type]
    return Example(made.capture, made.truth.models, made.truth.poses, made.truth.columns)
