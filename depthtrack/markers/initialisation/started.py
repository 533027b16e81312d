"""The result of an initialisation, and its JSON file for later captures.

Maycock et al. 2015, Sec. III-A: "This configuration can be saved and later loaded to ensure subsequent trials are
automated."
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from depthtrack.files import compact_json, read_json, write_atomic
from depthtrack.hand.pose import POSE_SIZE
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.types import Array, Index


@dataclass(frozen=True, eq=False)
class StartedModel:
    """A model found in a frame.

    model: with the sizes and offsets that fit the points.
    pose: (27,) capture frame, metres and radians.
    points: (M,) point of the frame that is each marker; -1 if it was not measured.
    energy: negative logarithm of the posterior density, up to a constant; for the paper's method Eq. (2), millimetres.
    residual: root mean square distance of the points from the markers of the pose, metres.
    margin: energy of the second best, different assignment less that of this one.
    confidence: probability that the assignment is right, 0 to 1.
    """

    model: MarkerModel
    pose: Array
    points: Index
    energy: float
    residual: float
    margin: float
    confidence: float

    def renumbered(self, numbers: Index) -> Self:
        """Return the model with point k called `numbers[k]`."""
        return replace(self, points=np.where(self.points >= 0, numbers[self.points], -1))

    def to_fields(self) -> dict[str, Any]:
        """Return the contents of the model's entry in the file."""
        return {
            "model": self.model.to_fields(),
            "pose": self.pose.tolist(),
            "points": self.points.tolist(),
            "energy": self.energy,
            "residual_mm": self.residual * 1000,
            "margin": self.margin,
            "confidence": self.confidence,
        }

    @classmethod
    def from_fields(cls, fields: dict[str, Any]) -> Self:
        """Return the model of an entry of the file.

        Raises:
            KeyError, TypeError, ValueError: if an entry is missing or malformed.
            InputError: if a number of the model is out of range.
        """
        model = MarkerModel.from_fields(fields["model"])
        pose = np.array(fields["pose"], dtype=np.float64).reshape(POSE_SIZE)
        points = np.array(fields["points"], dtype=np.int64).reshape(len(model.labels))
        numbers = {name: float(fields[name]) for name in ("energy", "margin", "confidence")}
        return cls(model, pose, points, residual=float(fields["residual_mm"]) / 1000, **numbers)


@dataclass(frozen=True, eq=False)
class StartedModels:
    """The models found in a frame, in the order given; None for one that was not found.

    frame: index of the frame in its capture.
    """

    models: tuple[StartedModel | None, ...]
    frame: int = 0

    @property
    def found(self) -> tuple[StartedModel, ...]:
        """The models that were found."""
        return tuple(started for started in self.models if started is not None)

    @property
    def confidence(self) -> float:
        """The probability that all models were found with the right assignment."""
        return float(np.prod([0.0 if started is None else started.confidence for started in self.models]))

    def to_json(self) -> str:
        """Return the text of the file, lengths of poses in metres."""
        entries = [None if started is None else started.to_fields() for started in self.models]
        return compact_json({"frame": self.frame, "models": entries})

    @classmethod
    def from_json(cls, path: Path) -> Self:
        """Return the models of a file written by `save_started`.

        Raises:
            InputError: if the file is missing or malformed, or a number is out of range.
        """
        return read_json(path, "the started models", cls._from_fields, made_by="depthtrack markers label")

    @classmethod
    def _from_fields(cls, fields: dict[str, Any]) -> Self:
        entries = [None if entry is None else StartedModel.from_fields(entry) for entry in fields["models"]]
        return cls(tuple(entries), int(fields["frame"]))


def save_started(started: StartedModels, path: Path) -> None:
    """Write the file that `StartedModels.from_json` reads.

    Raises:
        InputError: if the file cannot be written.
    """
    write_atomic(path, started.to_json())
