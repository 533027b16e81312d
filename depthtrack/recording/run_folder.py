"""The run folder: a tracker's result of every frame, readable after a kill at any time.

`run.json` holds the configuration of the run. `poses.csv` has a row a frame: index, timestamp, status, energy,
agreement, confidence, visibility of each finger, the pose, and the spread of each keypoint. The cells of a pose are
empty if there is none. `timings.csv` has the milliseconds of each stage, `branches.csv` the alternatives to the pose.
`failures.csv` lists frames in which something failed unexpectedly, if there are any. If poses of the backward pass
replace some of the forward ones, `forward.csv` holds the rows before that.
Poses of a resumed run are bitwise those of an uninterrupted one.
"""

import csv
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from depthtrack.closing import Closing
from depthtrack.errors import InputError
from depthtrack.files import read_text, write_atomic
from depthtrack.hand.kinematics import KEYPOINT_NAMES
from depthtrack.hand.pose import FINGERS, POSE_SIZE
from depthtrack.number_text import parse_numbers
from depthtrack.outputs import locked
from depthtrack.recording.branches import BRANCH_COLUMNS, branch_rows
from depthtrack.recording.frame_failures import append_failure, keep_failures, read_failures
from depthtrack.recording.run_continuation import check_same, check_unused
from depthtrack.recording.run_rows import FORWARD_FILE, ROW_COLUMNS, RunRow, read_rows, row_cells
from depthtrack.recording.run_tables import read_table, rewrite_table
from depthtrack.recording.status import Status
from depthtrack.strict_data import exact_json_text, parse_json
from depthtrack.types import Array, Index

BACKWARD_STAGE = "backward"
"""Column of the milliseconds of the backward pass."""


class RunWriter(Closing):
    """Appends frames to a run folder; every row is complete on disk before the next is written.

    rows: of the frames so far.
    revised: whether poses of the backward pass have replaced some of the forward ones.
    """

    def __init__(
        self,
        folder: Path,
        configuration: dict[str, Any],
        stages: Sequence[str],
        resume: bool = False,
        length: int | None = None,
    ) -> None:
        """Begin a run, or resume it.

        stages: names of the timings' columns.
        length: frames that a whole run has; None if unknown. A revised run that is not whole goes on from its forward
            rows, as it does if the recording has grown.

        Raises:
            InputError: if the folder holds a run and `resume` is false, or a run of another configuration, or another
                process writes to it.
        """
        self.folder = folder
        self._stages = tuple(stages)
        self.rows: list[RunRow] = []
        self.revised = False
        check_unused(folder, resume)
        folder.mkdir(parents=True, exist_ok=True)
        with ExitStack() as stack:
            stack.enter_context(locked(folder))
            check_unused(folder, resume)
            self._prepare(configuration, length)
            self._poses, self._timings, self._branches = (
                stack.enter_context((folder / name).open("a", newline="", encoding="utf-8"))
                for name in ("poses.csv", "timings.csv", "branches.csv")
            )
            self._open = stack.pop_all()

    def _prepare(self, configuration: dict[str, Any], length: int | None) -> None:
        """Write the tables of a new run, or keep the whole rows of a begun one."""
        folder = self.folder
        if (folder / "run.json").exists():
            before = read_configuration(folder)
            check_same(before, configuration, folder)
            if before.get("on_damage") != configuration.get("on_damage"):
                write_atomic(folder / "run.json", exact_json_text(configuration, indent=2) + "\n")
            self.rows = read_rows(folder)
            if (folder / FORWARD_FILE).exists():
                forward = read_rows(folder, FORWARD_FILE)
                whole = len(forward) >= (length or 0) and [row.index for row in forward] == [
                    row.index for row in self.rows
                ]
                self.revised = whole and bool(backward_frames(folder, self.rows))
                if self.revised:
                    for name, columns in (("timings.csv", ("index", *self._stages)), ("branches.csv", BRANCH_COLUMNS)):
                        read_table(folder / name, columns)
                    return
                self.rows = forward
            rewrite_table(folder / "poses.csv", ROW_COLUMNS, map(row_cells, self.rows))
            (folder / FORWARD_FILE).unlink(missing_ok=True)
            rewrite_table(folder / "timings.csv", ("index", *self._stages), self._timing_rows())
            keep_failures(folder, frozenset(row.index for row in self.rows))
            rewrite_table(folder / "branches.csv", BRANCH_COLUMNS, _branches(self.rows))
        else:
            rewrite_table(folder / "poses.csv", ROW_COLUMNS, ())
            rewrite_table(folder / "timings.csv", ("index", *self._stages), ())
            rewrite_table(folder / "branches.csv", BRANCH_COLUMNS, ())
            write_atomic(folder / "run.json", exact_json_text(configuration, indent=2) + "\n")

    def _timing_rows(self) -> list[list[str]]:
        """Return the cells of `timings.csv`, a row for each of `rows`; zeros if it has none."""
        found = {cells[0]: cells for cells in read_table(self.folder / "timings.csv", ("index", *self._stages))}
        indices = [str(row.index) for row in self.rows]
        return [found.get(index, [index, *("0.000" for _ in self._stages)]) for index in indices]

    def append(self, row: RunRow, stage_ms: dict[str, float], failure: str | None = None) -> None:
        """Append the next frame and the milliseconds of its stages.

        failure: what failed unexpectedly inside the frame, in one line.
        """
        # The poses last: a kill between the writes leaves surplus rows in the other tables, which resuming drops.
        if failure is not None:
            append_failure(self.folder, row.index, failure)
        if row.branches:
            csv.writer(self._branches).writerows(branch_rows(row.index, row.branches))
            self._branches.flush()
        csv.writer(self._timings).writerow([row.index, *(f"{stage_ms.get(stage, 0):.3f}" for stage in self._stages)])
        self._timings.flush()
        csv.writer(self._poses).writerow(row_cells(row))
        self._poses.flush()
        self.rows.append(row)

    def revise(
        self, rows: Mapping[int, RunRow], milliseconds: Mapping[int, float], failures: Mapping[int, str]
    ) -> None:
        """Replace rows of the complete run by those of the backward pass, by their place.

        milliseconds: of the frames that were tracked backwards, by their place.
        failures: what failed unexpectedly inside such a frame, in one line, by their place.
        """
        if not milliseconds:
            return
        forward = read_failures(self.folder)
        for place, failure in failures.items():
            if (index := self.rows[place].index) not in forward:
                append_failure(self.folder, index, f"backward pass: {failure}")
        timings = self._timing_rows()
        for place, duration in milliseconds.items():
            timings[place][1 + self._stages.index(BACKWARD_STAGE)] = f"{duration:.3f}"
        rewrite_table(self.folder / "timings.csv", ("index", *self._stages), timings)
        if not rows:
            return
        revised = [rows.get(place, row) for place, row in enumerate(self.rows)]
        # The poses last: until then, a resumed run begins the backward pass anew.
        rewrite_table(self.folder / FORWARD_FILE, ROW_COLUMNS, map(row_cells, self.rows))
        rewrite_table(self.folder / "branches.csv", BRANCH_COLUMNS, _branches(revised))
        rewrite_table(self.folder / "poses.csv", ROW_COLUMNS, map(row_cells, revised))
        self.revised = True

    def close(self) -> None:
        """Close the files, and free the folder for other processes."""
        self._open.close()


@dataclass(frozen=True)
class Run:
    """A complete or partial run of T frames.

    index: (T,) frame of the recording.
    timestamps: (T,) seconds.
    energy, agreement, confidence: (T,) of the poses, see `RunRow`.
    visibility: (T, 5) of the fingers, see `RunRow`.
    spread: (T, 21) of the keypoints, metres, see `RunRow`.
    poses: (T, 27) metres, quaternion, radians, camera frame; NaN if no hand was observed.
    stage_ms: (T,) milliseconds of each stage.
    failures: what failed unexpectedly, by the index of the frame.
    backward: indices of the frames whose pose is that of the backward pass.
    """

    folder: Path
    configuration: dict[str, Any]
    index: Index
    timestamps: Array
    status: tuple[Status, ...]
    energy: Array
    agreement: Array
    confidence: Array
    visibility: Array
    spread: Array
    poses: Array
    stage_ms: dict[str, Array]
    failures: Mapping[int, str] = field(default_factory=dict)
    backward: frozenset[int] = frozenset()

    @classmethod
    def load(cls, folder: Path) -> Self:
        """Read a run folder.

        Raises:
            InputError: if it holds no run, or a damaged one.
        """
        configuration, rows = read_configuration(folder), read_rows(folder)
        no_pose = np.full(POSE_SIZE, np.nan)
        return cls(
            folder,
            configuration,
            np.array([row.index for row in rows], dtype=np.int64),
            np.array([row.timestamp for row in rows], dtype=np.float64),
            tuple(row.status for row in rows),
            np.array([row.energy for row in rows], dtype=np.float64),
            np.array([row.agreement for row in rows], dtype=np.float64),
            np.array([row.confidence for row in rows], dtype=np.float64),
            np.array([row.visibility for row in rows], dtype=np.float64).reshape(-1, len(FINGERS)),
            np.array([row.spread for row in rows], dtype=np.float64).reshape(-1, len(KEYPOINT_NAMES)),
            np.array([no_pose if row.pose is None else row.pose for row in rows]).reshape(-1, POSE_SIZE),
            _read_timings(folder / "timings.csv", len(rows)),
            read_failures(folder),
            backward_frames(folder, rows),
        )


def backward_frames(folder: Path, rows: Sequence[RunRow]) -> frozenset[int]:
    """Return the indices of rows whose pose is that of the backward pass.

    The status alone may differ too, of a row after them.
    """
    if not (folder / FORWARD_FILE).exists():
        return frozenset()
    forward = {row.index: row for row in read_rows(folder, FORWARD_FILE)}
    return frozenset(
        row.index
        for row in rows
        if row.index not in forward or row_cells(replace(forward[row.index], status=row.status)) != row_cells(row)
    )


def _branches(rows: Iterable[RunRow]) -> list[list[str]]:
    """Return the cells of the branches of rows."""
    return [cells for row in rows for cells in branch_rows(row.index, row.branches)]


def read_configuration(folder: Path) -> dict[str, Any]:
    """Return the contents of `run.json`.

    Raises:
        InputError: if the file is missing or malformed.
    """
    try:
        configuration = parse_json(read_text(folder / "run.json"))
    except InputError as error:
        raise InputError(f"{folder} holds no run ({error}); make one with `depthtrack track`") from error
    except ValueError as error:
        raise InputError(f"{folder} holds no run (run.json: {error}); make one with `depthtrack track`") from error
    if not isinstance(configuration, dict):
        raise InputError(f"{folder / 'run.json'} must hold a JSON object")
    return configuration


def _read_timings(path: Path, count: int) -> dict[str, Array]:
    """Return the milliseconds (T,) of each stage, of at most `count` frames."""
    header, *lines = read_table(path, None)
    if header[:1] != ["index"]:
        raise InputError(f"{path} must begin with a line of columns, 'index' and the tracker's stages")
    rows = []
    for number, cells in enumerate(lines[:count], start=2):
        try:
            rows.append(parse_numbers(cells[1:]))
        except ValueError as error:
            raise InputError(f"{path}, line {number}: expected milliseconds: {error}") from error
        if len(cells) != len(header):
            raise InputError(f"{path}, line {number}: expected {len(header)} columns, found {len(cells)}")
    columns = np.array(rows, dtype=np.float64).reshape(len(rows), len(header) - 1)
    return {stage: columns[:, k] for k, stage in enumerate(header[1:])}
