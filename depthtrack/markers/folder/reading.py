"""Read a marker folder; its files are input from elsewhere and checked as such."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from depthtrack.errors import InputError
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.filled_capture import FilledCapture
from depthtrack.markers.folder.contents import MODELS, Contents, is_marker_folder
from depthtrack.markers.folder.filled_samples import read_filled
from depthtrack.markers.folder.tables import read_rigid_poses, read_values
from depthtrack.markers.formats.conditioning import METRES
from depthtrack.markers.formats.registry import find_format
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.recording.run_folder import Run
from depthtrack.types import Array, Index

TRUTH = "truth"
"""Name of the folder with the truth of a synthetic capture."""


@dataclass(frozen=True, eq=False)
class MarkerFolder:
    """A folder that a marker command wrote.

    path: of the folder.
    contents: of its `markers.json`.
    labelled: labels and poses. Its capture has the labelled trajectories, then those without a label.
    filled: the capture without gaps; None if none were filled. Both have the poses of the filled capture then.
    """

    path: Path
    contents: Contents
    labelled: LabelledCapture
    filled: FilledCapture | None = None

    @classmethod
    def load(cls, path: Path) -> "MarkerFolder":
        """Read a marker folder.

        Raises:
            InputError: if it is none, or a file is missing, malformed, or of other frames or markers.
        """
        contents = Contents.load(path)
        models = tuple(_model(path / MODELS / f"{name}.json", name) for name in contents.models)
        capture = _trajectories(path / contents.labelled, contents)
        poses = tuple(_poses(path, model, len(capture)) for model in models)
        unread = LabelledCapture(capture, models, (), poses, ())
        labels = [unread.labels(k) for k in range(len(models))]
        every = [label for each in labels for label in each]
        place = _place(capture, every, path / contents.labelled)
        positions = capture.positions[:, place]
        filled = read_filled(path / "filled.csv", every, contents.first_frame, positions) if contents.filled else None
        if filled is not None:
            capture.positions[:, place] = np.where(filled.is_filled[..., None], np.nan, positions)
        measured = np.isfinite(capture.positions[:, place]).all(axis=-1)
        confidence = read_values(path / "confidence.csv", every, len(capture))
        if np.any((confidence < 0) | (confidence > 1)):
            raise InputError(f"{path / 'confidence.csv'}: expected probabilities from 0 to 1")
        ends = np.cumsum([len(each) for each in labels])[:-1]

        def split(values: Any) -> tuple[Any, ...]:
            return tuple(np.split(values, ends, axis=1))

        labelled = LabelledCapture(capture, models, split(np.where(measured, place, -1)), poses, split(confidence))
        if filled is None:
            return cls(path, contents, labelled)
        how, errors = split(filled.how), split(filled.expected_error)
        return cls(path, contents, labelled, FilledCapture(labelled, split(positions), how, errors, poses))

    def check_source(self) -> None:
        """Raise InputError if the source of the folder is still there, but has changed since."""
        if self.contents.source is not None:
            self.contents.source.check()


def truth_beside(source: Path) -> LabelledCapture | None:
    """Return the truth of a synthetic capture, from the folder beside it; None without one.

    Raises:
        InputError: if that folder is malformed.
    """
    folder = source.parent / TRUTH
    return MarkerFolder.load(folder).labelled if is_marker_folder(folder) else None


def _model(path: Path, name: str) -> MarkerModel:
    model = MarkerModel.from_json(path)
    if model.name != name:
        raise InputError(f"{path} must hold the model '{name}', found '{model.name[:64]}'")
    return model


def _trajectories(path: Path, contents: Contents) -> MarkerCapture:
    """Return the trajectories with their labels as written."""
    stored = find_format(path).read(path)
    labels, count = stored.labels, stored.positions.shape[1]
    if len(labels) != count or len(set(labels)) != count:
        raise InputError(f"{path}: expected {count} labels, all different, found {len(set(labels))}")
    positions = stored.positions * METRES.get(stored.unit or "mm", METRES["mm"])
    if stored.residuals is not None:
        positions[stored.residuals < 0] = np.nan
    return MarkerCapture(contents.rate, labels, positions, None, contents.first_frame, contents.notes)


def _place(capture: MarkerCapture, labels: list[str], path: Path) -> Index:
    """Return the trajectory (M,) of each marker. Raises InputError if one is missing."""
    column = {label: k for k, label in enumerate(capture.labels)}
    missing = [label for label in labels if label not in column]
    if missing:
        raise InputError(f"{path}: expected the marker '{missing[0][:80]}' of a model, found no such trajectory")
    return np.array([column[label] for label in labels], dtype=np.int64)


def _poses(path: Path, model: MarkerModel, frames: int) -> Array:
    if model.is_rigid:
        return read_rigid_poses(path / f"{model.name}.csv", frames)
    run = Run.load(path / model.name)
    if not np.array_equal(run.index, np.arange(frames)):
        raise InputError(f"{path / model.name}: expected a pose row for each of {frames} frames")
    return run.poses
