"""Read a marker folder; its files are input from elsewhere and checked as such."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from depthtrack.errors import InputError
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.folder.contents import MODELS, Contents
from depthtrack.markers.folder.tables import read_rigid_poses, read_values
from depthtrack.markers.formats.conditioning import METRES
from depthtrack.markers.formats.registry import find_format
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.recording.run_folder import Run
from depthtrack.types import Array, Index


@dataclass(frozen=True, eq=False)
class MarkerFolder:
    """A folder that a marker command wrote.

    path: of the folder.
    contents: of its `markers.json`.
    labelled: labels and poses. Its capture has the labelled trajectories, then those without a label.
    """

    path: Path
    contents: Contents
    labelled: LabelledCapture

    @classmethod
    def load(cls, path: Path) -> "MarkerFolder":
        """Read a marker folder.

        Raises:
            InputError: if it is none, or a file is missing, malformed, or of other frames or markers.
            MissingExtraError: if its trajectories are C3D and ezc3d is not installed.
        """
        contents = Contents.load(path)
        models = tuple(_model(path / MODELS / f"{name}.json", name) for name in contents.models)
        capture = _trajectories(path / contents.labelled, contents)
        poses = tuple(_poses(path, model, len(capture)) for model in models)
        unread = LabelledCapture(capture, models, (), poses, ())
        labels = [unread.labels(k) for k in range(len(models))]
        columns = tuple(_columns(capture, each, path / contents.labelled) for each in labels)
        every = [label for each in labels for label in each]
        confidence = read_values(path / "confidence.csv", every, len(capture))
        if np.any((confidence < 0) | (confidence > 1)):
            raise InputError(f"{path / 'confidence.csv'}: expected probabilities from 0 to 1")
        ends = np.cumsum([len(each) for each in labels])[:-1]
        parts = tuple(np.split(confidence, ends, axis=1))
        return cls(path, contents, LabelledCapture(capture, models, columns, poses, parts))

    def check_source(self) -> None:
        """Raise InputError if the source of the folder is missing or has changed since."""
        if self.contents.source is not None:
            self.contents.source.check()


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


def _columns(capture: MarkerCapture, labels: tuple[str, ...], path: Path) -> Index:
    """Return the trajectory (T, M) of each marker, -1 where it was not measured."""
    column = {label: k for k, label in enumerate(capture.labels)}
    missing = [label for label in labels if label not in column]
    if missing:
        raise InputError(f"{path}: expected the marker '{missing[0][:80]}' of a model, found no such trajectory")
    chosen = np.array([column[label] for label in labels], dtype=np.int64)
    return np.where(np.isfinite(capture.positions[:, chosen]).all(axis=-1), chosen, -1)


def _poses(path: Path, model: MarkerModel, frames: int) -> Array:
    if model.is_rigid:
        return read_rigid_poses(path / f"{model.name}.csv", frames)
    run = Run.load(path / model.name)
    if not np.array_equal(run.index, np.arange(frames)):
        raise InputError(f"{path / model.name}: expected a pose row for each of {frames} frames")
    return run.poses
