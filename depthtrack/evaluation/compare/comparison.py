"""A comparison from its plan to its run folders, on all cores or a cluster; what is there already is not made again."""

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
_LOOK_EVERY = 0.4


@dataclass(frozen=True)
class Comparison:
    """What to compare: every contender on every recording, `repeats` times with seeds from `seed` on.

    With `equal_ms`, each contender does as much work as fits into so many CPU milliseconds a frame, segmentation,
    which all share, not counted.
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
            raise InputError(f"a comparison has 1 to {MOST_RUNS} runs: choose other repeats, found {self.repeats}")
        if not 0 <= self.seed < 2**62:
            raise InputError(f"the seed must be a whole number from 0 to 2^62 - 1, found {self.seed}")
        if self.equal_ms is not None and not 0.1 <= self.equal_ms <= 60_000:
            raise InputError(f"equal time must lie between 0.1 and 60000 ms a frame, found {self.equal_ms:g}")


@dataclass(frozen=True)
class ComparisonProgress:
    """What is going on: `what` in words, `frames` tracked of `total` (0 where not counted in frames)."""

    what: str
    frames: int = 0
    total: int = 0


Listener = Callable[[ComparisonProgress], None]


def compare(
    comparison: Comparison, folder: Path, workers: Workers, listener: Listener = lambda progress: None
) -> list[PlannedRun]:
    """Make all runs of a comparison under `folder`/runs, those that are missing or not whole; give all, in order.

    Raises InputError where a recording cannot be used or `folder` holds runs of other options, before any work.
    """
    # Workers may stand elsewhere.
    folder = folder.resolve()
    totals = {source: source.count(source.open()) for source in comparison.sources}
    budgets = _budgets(comparison, folder, workers, listener)
    plans = _plans(comparison, folder, budgets)
    left = [plan for plan in plans if plan.state() != "done"]
    folders = [Path(plan.folder) for plan in plans]
    total = sum(totals[plan.source] for plan in plans)
    with _watching(folders, total, listener):
        for _ in workers.measure(track_cell, [plan.to_cell() for plan in left]):
            pass
    return plans


def _plans(comparison: Comparison, folder: Path, budgets: dict[tuple[int, int], Cell]) -> list[PlannedRun]:
    names = _unique_names([Path(source.path) for source in comparison.sources])
    plans = []
    for s, (source, name) in enumerate(zip(comparison.sources, names, strict=True)):
        for c, spec in enumerate(comparison.specs):
            budget = budgets.get((s, c))
            options = budget["chosen"] if budget else to_data(spec.config)
            told = budget and {"equal_ms": comparison.equal_ms, "calibrated_ms": budget["calibrated_ms"]}
            for seed in range(comparison.seed, comparison.seed + comparison.repeats):
                run = folder / "runs" / f"{name}_{spec.slug}_{seed}"
                plans.append(PlannedRun(str(run), source, spec.label, spec.config.name, options, seed, told))
    return plans


def _budgets(
    comparison: Comparison, folder: Path, workers: Workers, listener: Listener
) -> dict[tuple[int, int], dict[str, Any]]:
    """The work of every contender on every recording (by their numbers), for equal time; none without.

    Measured once and written down: another measurement would find slightly other budgets, and the runs not theirs.
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
    listener(ComparisonProgress(f"finding the work that takes {comparison.equal_ms:g} ms of CPU time a frame"))
    with Journal(folder / "budgets.jsonl", list(cells[0])) as journal:
        return dict(zip(numbers, run_sweep(calibrate_cell, cells, journal, workers), strict=True))


def _unique_names(paths: Sequence[Path]) -> list[str]:
    """A name for every recording: its folder's, with a number where several have the same."""
    names: list[str] = []
    for path in paths:
        name = path.resolve().name
        count = sum(other == name or other.startswith(f"{name}~") for other in names)
        names.append(name if count == 0 else f"{name}~{count + 1}")
    return names


@contextmanager
def _watching(folders: Sequence[Path], total: int, listener: Listener) -> Iterator[None]:
    """Tell the listener from time to time how many frames the run folders hold, wherever their workers are."""
    finished, count = Event(), FrameCount(folders)

    def watch() -> None:
        while not finished.wait(_LOOK_EVERY):
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
