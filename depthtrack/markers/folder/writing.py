"""Write a marker folder, complete or absent; the same input gives the same bytes."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from depthtrack.errors import InputError
from depthtrack.files import new_folder, write_atomic
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.filled_capture import FilledCapture, Filling
from depthtrack.markers.folder.contents import (
    CONTENTS_FILE,
    MODELS,
    SUFFIXES,
    Contents,
    Source,
    check_names,
    is_marker_folder,
)
from depthtrack.markers.folder.filled_samples import write_filled
from depthtrack.markers.folder.hand_run import write_hand_run
from depthtrack.markers.folder.tables import check_labels, write_rigid_poses, write_values
from depthtrack.markers.formats.registry import write_capture
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.tracking.run_configuration import versions


def write_marker_folder(
    folder: Path,
    labelled: LabelledCapture,
    source: Source | None = None,
    configuration: Mapping[str, Any] | None = None,
    truth: LabelledCapture | None = None,
    suffix: str = ".csv",
    filled: FilledCapture | None = None,
) -> None:
    """Write labels, poses and models of a capture; the numbers of text files read back equal.

    source: file that the capture was read from.
    configuration: options of the labelling as JSON values.
    truth: true poses of models of the same names, for the evaluation of a synthetic capture.
    suffix: of the file of trajectories, one of `SUFFIXES`.
    filled: the capture without gaps; its positions and poses are written then.

    Raises:
        InputError: if the folder holds markers already, a name cannot be that of a file, or a file cannot be written.
    """
    with new_marker_folder(folder) as work:
        write_marker_files(work, labelled, source, configuration, truth, suffix, filled)


@contextmanager
def new_marker_folder(folder: Path) -> Iterator[Path]:
    """Yield a hidden folder to fill, which becomes `folder` if the block succeeds.

    Raises:
        InputError: if the folder is in use, or cannot be written.
    """
    check_unused(folder)
    with new_folder(folder, CONTENTS_FILE, "a marker folder", overwrite=False) as work:
        yield work
        check_unused(folder)


def write_marker_files(
    folder: Path,
    labelled: LabelledCapture,
    source: Source | None = None,
    configuration: Mapping[str, Any] | None = None,
    truth: LabelledCapture | None = None,
    suffix: str = ".csv",
    filled: FilledCapture | None = None,
) -> None:
    """Write the files of `write_marker_folder` to a folder from `new_marker_folder`."""
    if filled is not None:
        labelled = _measured(filled)
    capture = labelled.capture
    name = "capture" if source is None else Path(source.path).name
    contents = Contents(
        labelled=f"labelled{suffix}",
        rate=capture.rate,
        first_frame=capture.first_frame,
        models=tuple(model.name for model in labelled.models),
        source=source,
        configuration=configuration or {},
        filled=filled is not None,
        notes=capture.notes,
        versions=versions(),
    )
    written = labelled.labelled() if filled is None else filled.capture()
    check_labels(written.labels)
    (folder / MODELS).mkdir()
    write_capture(folder / contents.labelled, _joined(written, labelled.rest()))
    residuals = [labelled.residuals(k) for k in range(len(labelled.models))]
    first = capture.first_frame
    write_values(folder / "confidence.csv", written.labels, first, np.concatenate(labelled.confidence, axis=1))
    write_values(folder / "residual.csv", written.labels, first, 1000 * np.concatenate(residuals, axis=1))
    if filled is not None:
        write_filled(folder / "filled.csv", filled)
    for k, model in enumerate(labelled.models):
        write_atomic(folder / MODELS / f"{model.name}.json", model.to_json())
        if model.is_rigid:
            write_rigid_poses(folder / f"{model.name}.csv", first, capture.times, labelled.poses[k])
        else:
            write_hand_run(folder / model.name, labelled, k, name, truth)
    write_atomic(folder / CONTENTS_FILE, contents.to_json())


def check_unused(folder: Path) -> None:
    """Raise InputError if the folder holds anything already, or is a file."""
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder} must be a folder, found a file: choose another name")
    if is_marker_folder(folder):
        raise InputError(f"{folder} already holds labelled markers: choose another folder")
    if folder.exists() and any(folder.iterdir()):
        raise InputError(f"{folder} must be a new or an empty folder, found files in it: choose another name")


def check_output(folder: Path, names: tuple[str, ...], suffix: str = ".csv") -> None:
    """Check a folder before the work starts.

    names: of the models.

    Raises:
        InputError: if the folder is in use, or a name or the suffix is unusable.
    """
    check_unused(folder)
    check_names(names)
    if suffix not in SUFFIXES:
        raise InputError(f"the trajectories must be written as {', '.join(SUFFIXES)}, found '{suffix[:20]}'")


def _measured(filled: FilledCapture) -> LabelledCapture:
    """Return the labels of measured, kept samples, with the poses of all frames."""
    columns = zip(filled.labelled.columns, filled.how, strict=True)
    kept = tuple(np.where(how == Filling.MEASURED, column, -1) for column, how in columns)
    return replace(filled.labelled, columns=kept, poses=filled.poses)


def _joined(first: MarkerCapture, second: MarkerCapture) -> MarkerCapture:
    """Return the trajectories of two captures of the same frames."""
    positions = np.concatenate([first.positions, second.positions], axis=1)
    return replace(first, labels=(*first.labels, *second.labels), positions=positions)
