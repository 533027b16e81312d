"""Run a comparison on all cores or on a cluster; complete runs are kept."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from threading import Event, Thread
from typing import Any

from depthtrack.errors import InputError
from depthtrack.evaluation.compare.running import FrameCount, PlannedRun, Source, calibrate_cell, track_cell
from depthtrack.evaluation.compare.specs import TrackerSpec
from depthtrack.evaluation.sweep.rows import Cell, Journal
from depthtrack.evaluation.sweep.run import Workers, run_sweep
from depthtrack.options import to_data

MOST_RUNS = 100_000
"""Largest number of runs in a comparison."""
_INTERVAL = 0.4
"""Seconds between two counts of the tracked frames."""


@dataclass(frozen=True)
class Comparison:
    """Plan of a comparison: each tracker on each recording.

    sources: recordings.
    specs: trackers.
    repeats: runs per tracker and recording, with consecutive seeds.
    seed: first seed.
    equal_ms: CPU milliseconds per frame without segmentation, to which the work of each tracker is scaled; None to
        keep the configured work.

    Raises:
        InputError: if a value is out of range, or there is no recording.
    """

    sources: tuple[Source, ...]
    specs: tuple[TrackerSpec, ...]
    repeats: int = 1
    seed: int = 0
    equal_ms: float | None = None

    def __post_init__(self) -> None:
        if not self.sources:
            raise InputError("name at least one recording to compare on")
        if self.repeats < 1 or len(self.sources) * len(self.specs) * self.repeats > MOST_RUNS:
            raise InputError(f"repeats must give 1 to {MOST_RUNS} runs, found {self.repeats}: choose another number")
        if not 0 <= self.seed < 2**62:
            raise InputError(f"the seed must be from 0 to 2^62 - 1, found {self.seed}")
        if self.equal_ms is not None and not 0.1 <= self.equal_ms <= 60_000:
            raise InputError(f"equal time must be from 0.1 to 60000 ms per frame, found {self.equal_ms:g}")


@dataclass(frozen=True)
class ComparisonProgress:
    """Progress of a comparison.

    step: description of the current step.
    frames: number of tracked frames.
    total: number of frames to track; 0 if the step does not track.
    """

    step: str
    frames: int = 0
    total: int = 0


Listener = Callable[[ComparisonProgress], None]


def compare(
    comparison: Comparison, folder: Path, workers: Workers, listener: Listener = lambda progress: None
) -> list[PlannedRun]:
    """Make the missing and incomplete runs of a comparison, and return all runs in order.

    folder: folder to write to; the runs are in its folder `runs`.
    listener: called with the progress.

    Raises:
        InputError: if a recording is unusable, or `folder` contains runs with other options.
        SweepError: if a run failed.
    """
    # Workers may have another current folder.
    folder = folder.resolve()
    frames = sum(source.count(source.open()) for source in comparison.sources)
    budgets = _budgets(comparison, folder, workers, listener)
    plans = _plans(comparison, folder, budgets)
    missing = [plan for plan in plans if plan.state() != "done"]
    folders = [Path(plan.folder) for plan in plans]
    total = frames * len(comparison.specs) * comparison.repeats
    with _reported(folders, total, listener):
        for _ in workers.measure(track_cell, [plan.to_cell() for plan in missing]):
            pass
    return plans


def _plans(comparison: Comparison, folder: Path, budgets: dict[tuple[int, int], Cell]) -> list[PlannedRun]:
    names = _unique_names([Path(source.path) for source in comparison.sources])
    plans = []
    for s, (source, name) in enumerate(zip(comparison.sources, names, strict=True)):
        for c, spec in enumerate(comparison.specs):
            budget = budgets.get((s, c))
            options = budget["chosen"] if budget else to_data(spec.config)
            reported = budget and {"equal_ms": comparison.equal_ms, "calibrated_ms": budget["calibrated_ms"]}
            for seed in range(comparison.seed, comparison.seed + comparison.repeats):
                run = folder / "runs" / f"{name}_{spec.slug}_{seed}"
                plans.append(PlannedRun(str(run), source, spec.label, spec.config.name, options, seed, reported))
    return plans


def _budgets(
    comparison: Comparison, folder: Path, workers: Workers, listener: Listener
) -> dict[tuple[int, int], dict[str, Any]]:
    """Return the budgets by the numbers of recording and tracker; none without equal time.

    They are measured once and stored, since another measurement would differ and invalidate the runs.
    """
    if comparison.equal_ms is None:
        return {}
    numbers = [(s, c) for s in range(len(comparison.sources)) for c in range(len(comparison.specs))]
    cells: list[Cell] = [
        {
            "source": asdict(comparison.sources[s]),
            "tracker": comparison.specs[c].config.name,
            "options": to_data(comparison.specs[c].config),
            "ms": comparison.equal_ms,
        }
        for s, c in numbers
    ]
    listener(ComparisonProgress(f"scaling the work to {comparison.equal_ms:g} ms of CPU time per frame"))
    with Journal(folder / "budgets.jsonl", list(cells[0])) as journal:
        return dict(zip(numbers, run_sweep(calibrate_cell, cells, journal, workers), strict=True))


def _unique_names(paths: Sequence[Path]) -> list[str]:
    """Return a name for each recording: that of its folder, with a number if it occurs again."""
    names: list[str] = []
    for path in paths:
        name = path.resolve().name
        count = sum(other == name or other.startswith(f"{name}~") for other in names)
        names.append(name if count == 0 else f"{name}~{count + 1}")
    return names


@contextmanager
def _reported(folders: Sequence[Path], total: int, listener: Listener) -> Iterator[None]:
    """Report the number of frames in the run folders at intervals, for workers on any machine."""
    finished, count = Event(), FrameCount(folders)

    def watch() -> None:
        while not finished.wait(_INTERVAL):
            listener(ComparisonProgress("tracking", count(), total))

    listener(ComparisonProgress("tracking", count(), total))
    thread = Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield
    finally:
        finished.set()
        thread.join()
    listener(ComparisonProgress("tracking", count(), total))
