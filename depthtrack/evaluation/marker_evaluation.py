"""Evaluate a marker folder against true labels, positions and poses."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from depthtrack.errors import InputError
from depthtrack.evaluation.metrics.markers import (
    AngleErrors,
    LabelScore,
    PositionErrors,
    label_score,
    matching_samples,
)
from depthtrack.evaluation.metrics.trajectories import TrajectoryScore, trajectory_score
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.filled_capture import FilledCapture, Filling
from depthtrack.markers.folder.contents import is_marker_folder
from depthtrack.markers.folder.reading import MarkerFolder
from depthtrack.markers.formats.registry import read_capture
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.named_labels import places_by_name
from depthtrack.synthesis.marker_folder import COMPLETE_FILE, TRUTH
from depthtrack.types import Array, Index


@dataclass(frozen=True, eq=False)
class MarkerTruth:
    """What is known about a capture.

    name: where it comes from.
    samples: labelled samples as measured.
    positions: true positions with the same labels; those of `samples` if nothing better is known.
    poses: (T, 27) of the hands of these names; empty if unknown.
    """

    name: str
    samples: MarkerCapture
    positions: MarkerCapture
    poses: dict[str, Array]

    @classmethod
    def of_capture(cls, path: Path) -> "MarkerTruth":
        """Return the labels of a capture file.

        Raises:
            InputError: if it cannot be read or has no label.
        """
        capture = read_capture(path)
        labels = tuple(label for label, known in zip(capture.labels, capture.is_labelled, strict=True) if known)
        if not labels:
            raise InputError(f"{path} has no labelled trajectory, so it states no truth")
        return cls(str(path), capture.selected(labels), capture.selected(labels), {})

    @classmethod
    def of_folder(cls, path: Path) -> "MarkerTruth":
        """Return the labels and poses of a marker folder, such as the truth of a synthetic capture.

        path: of the marker folder, or of a synthetic capture that holds it.

        Raises:
            InputError: if it is neither, or malformed.
        """
        if not is_marker_folder(path) and is_marker_folder(path / TRUTH):
            path = path / TRUTH
        labelled = MarkerFolder.load(path).labelled
        samples, complete = labelled.labelled(), path / COMPLETE_FILE
        positions = read_capture(complete, unit="mm") if complete.is_file() else samples
        if set(positions.labels) != set(samples.labels) or len(positions) != len(samples):
            raise InputError(f"{complete} must have the labels and frames of {path}")
        poses = {
            model.name: poses
            for model, poses in zip(labelled.models, labelled.poses, strict=True)
            if model.hand is not None
        }
        return cls(str(path), samples, positions.selected(samples.labels), poses)

    def during(self, capture: MarkerCapture) -> "MarkerTruth":
        """Return the truth about a part of the same capture, by the numbers of frames.

        Raises:
            InputError: if it lacks some of them.
        """
        count, first = len(capture), capture.first_frame - self.samples.first_frame
        if len(self.samples) == count:
            return self
        if not 0 <= first <= len(self.samples) - count:
            raise InputError(
                f"{self.name} must have the {count} frames from {capture.first_frame} on that were labelled, "
                f"found {len(self.samples)} from {self.samples.first_frame} on"
            )
        chosen = slice(first, first + count)
        poses = {name: rows[chosen] for name, rows in self.poses.items()}
        samples, positions = (each.between(chosen.start, chosen.stop) for each in (self.samples, self.positions))
        return MarkerTruth(self.name, samples, positions, poses)


@dataclass(frozen=True, eq=False)
class MarkerEvaluation:
    """Scores of a marker folder.

    folder, truth: names of both.
    frames: number of frames.
    angles: of each hand whose true poses are known.
    """

    folder: str
    truth: str
    frames: int
    labels: LabelScore
    positions: PositionErrors
    angles: dict[str, AngleErrors]

    def to_json(self) -> dict[str, Any]:
        """Return all scores as JSON values."""
        return {
            "folder": self.folder,
            "truth": self.truth,
            "frames": self.frames,
            "labels": self.labels.to_json(),
            "position_error_mm": self.positions.to_json(),
            "hands": {name: errors.to_json() for name, errors in self.angles.items()},
        }


def evaluate_marker_folder(path: Path, labels: Path | None = None, truth: Path | None = None) -> MarkerEvaluation:
    """Return the evaluation of a marker folder.

    labels: capture file with true labels.
    truth: marker folder with true labels and poses, or a synthetic capture. Without both, the folder's source must be a
        synthetic capture.

    Raises:
        InputError: if a folder or file is missing or malformed, both truths are given, or none is found.
    """
    folder = MarkerFolder.load(path)
    if labels is not None and truth is not None:
        raise InputError("--labels and --truth both state the truth: give one of them")
    if labels is not None:
        known = MarkerTruth.of_capture(labels)
    elif truth is not None:
        known = MarkerTruth.of_folder(truth)
    else:
        source = folder.contents.source
        beside = None if source is None else Path(source.path).parent
        if beside is None or not is_marker_folder(beside / TRUTH):
            raise InputError(f"the truth about {path} is unknown: give --labels FILE or --truth FOLDER")
        known = MarkerTruth.of_folder(beside / TRUTH)
    return evaluate_labelled(folder.labelled, known, str(path), folder.filled)


def evaluate_trajectories(path: Path, labels: Path) -> TrajectoryScore:
    """Return the score of a capture file whose trajectories were linked without models.

    labels: labelled capture file of the same points.

    Raises:
        InputError: if a file is missing or malformed, or they have different numbers of frames.
    """
    given, truth = read_capture(path), MarkerTruth.of_capture(labels)
    if len(given) != len(truth.samples):
        raise InputError(f"{labels} must have the {len(given)} frames of {path}, found {len(truth.samples)}")
    return trajectory_score(given.positions, truth.samples.positions)


def evaluate_labelled(
    labelled: LabelledCapture, truth: MarkerTruth, name: str = "", filled: FilledCapture | None = None
) -> MarkerEvaluation:
    """Return the evaluation of a labelled capture, and of its filled gaps.

    True samples that are not in the capture, because they were cut out of it, need no label.

    Raises:
        InputError: if the truth has other frames, none of the markers, or none of the points.
    """
    frames, truth = len(labelled.capture), truth.during(labelled.capture)
    labels, expected = labelled.labelled().labels, np.concatenate(places_by_name(truth.samples.labels, labelled.models))
    if np.all(expected < 0):
        raise InputError(
            f"{truth.name} has none of the labels, such as '{labels[0]}', but '{truth.samples.labels[0]}': "
            "use a layout with its labels (docs/marker-synthesis.md)"
        )
    points = labelled.capture.positions
    captured = matching_samples(truth.samples.positions, points) >= 0
    if not captured.any():
        raise InputError(f"{truth.name} has no point at the position of one that was labelled: it is another capture")
    score = label_score(
        labels,
        labelled.labelled().positions,
        np.where(captured[..., None], truth.samples.positions, np.nan),
        truth.samples.labels,
        expected,
        int(np.isfinite(points).all(axis=-1).sum()),
    )
    errors = _position_errors(labelled, truth, expected, filled)
    poses = labelled.poses if filled is None else filled.poses
    return MarkerEvaluation(name, truth.name, frames, score, errors, dict(_angles(labelled, truth, poses)))


def _position_errors(
    labelled: LabelledCapture, truth: MarkerTruth, expected: Index, filled: FilledCapture | None
) -> PositionErrors:
    """Return the distances of all markers, measured or filled, from their true positions."""
    given = labelled.labelled()
    true = np.where(expected[:, None] >= 0, truth.positions.positions[:, expected], np.nan)
    positions, how = given.positions, np.full(given.positions.shape[:2], Filling.MEASURED, dtype=np.int64)
    stated = np.full(how.shape, np.nan)
    if filled is not None:
        positions, how = np.concatenate(filled.positions, axis=1), np.concatenate(filled.how, axis=1)
        stated = np.concatenate(filled.expected_error, axis=1)
    words = np.array([way.word for way in Filling])
    return PositionErrors(
        given.labels, 1000 * np.linalg.norm(positions - true, axis=-1), words[how], 1000 * np.asarray(stated)
    )


def _angles(
    labelled: LabelledCapture, truth: MarkerTruth, poses: tuple[Array, ...]
) -> Iterator[tuple[str, AngleErrors]]:
    for k, model in enumerate(labelled.models):
        if model.name in truth.poses and model.hand is not None:
            measured = np.asarray(labelled.columns[k] >= 0)
            yield model.name, AngleErrors.between(poses[k], truth.poses[model.name], measured, model.bodies)
