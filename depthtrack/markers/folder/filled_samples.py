"""The table of filled samples: frame, label, way of filling, expected error."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from depthtrack.errors import InputError
from depthtrack.markers.filled_capture import FilledCapture, Filling
from depthtrack.number_text import parse_number_or_blank, parse_whole_number
from depthtrack.recording.run_tables import read_table, rewrite_table
from depthtrack.types import Array, Index, Mask

COLUMNS = ("frame", "label", "how", "expected_error_mm")
_WAYS = {way.word: way for way in Filling if way not in (Filling.MEASURED, Filling.GAP)}


class FilledSamples(NamedTuple):
    """What the table states of T frames of M markers.

    how: (T, M) `Filling`.
    expected_error: (T, M) metres; NaN unless filled.
    """

    how: Index
    expected_error: Array

    @property
    def is_filled(self) -> Mask:
        """Which samples (T, M) were filled."""
        return np.asarray((self.how != Filling.MEASURED) & (self.how != Filling.GAP))


def write_filled(path: Path, filled: FilledCapture) -> None:
    """Write a row for each filled sample, by frame.

    Raises:
        InputError: if the file cannot be written.
    """
    rewrite_table(path, COLUMNS, _rows(filled))


def read_filled(path: Path, labels: Sequence[str], first_frame: int, positions: Array) -> FilledSamples:
    """Return how samples were filled.

    labels: of the M markers.
    first_frame: number of the first frame.
    positions: (T, M, 3) measured and filled; a sample with neither is a gap.

    Raises:
        InputError: if the table is malformed, or of a sample that has no position.
    """
    known = np.asarray(np.isfinite(positions).all(axis=-1))
    samples = FilledSamples(np.where(known, Filling.MEASURED, Filling.GAP), np.full(known.shape, np.nan))
    column = {label: m for m, label in enumerate(labels)}
    for number, (frame, label, how, error) in enumerate(read_table(path, COLUMNS), start=2):
        try:
            t, m, way = parse_whole_number(frame) - first_frame, column[label], _WAYS[how]
            expected = parse_number_or_blank(error) / 1000
        except (ValueError, KeyError) as reason:
            raise InputError(f"{path}, line {number}: expected frame, label, way, error: {reason!s:.80}") from reason
        if not 0 <= t < len(known) or not known[t, m] or expected < 0 or np.isinf(expected):
            raise InputError(f"{path}, line {number}: expected a sample with a position and an error of at least 0")
        samples.how[t, m], samples.expected_error[t, m] = way, expected
    return samples


def _rows(filled: FilledCapture) -> Iterator[list[str]]:
    labels = [label for k in range(len(filled.how)) for label in filled.labelled.labels(k)]
    how, errors = np.concatenate(filled.how, axis=1), 1000 * np.concatenate(filled.expected_error, axis=1)
    first = filled.labelled.capture.first_frame
    for t, m in np.argwhere((how != Filling.MEASURED) & (how != Filling.GAP)):
        error = repr(float(errors[t, m])) if np.isfinite(errors[t, m]) else ""
        yield [str(first + t), labels[m], Filling(int(how[t, m])).word, error]
