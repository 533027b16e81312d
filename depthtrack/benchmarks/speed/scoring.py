"""`depthtrack bench score`: measure hypotheses per second of backends and baselines.

The time includes kinematics, rendering and objective. It leaves out the setting of a target, which a tracker does once
per frame. Each scorer runs in its own process, so that its first call includes compilation and loading.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from time import perf_counter
from typing import Any, Literal

import numpy as np

from depthtrack.benchmarks.speed.baselines import BASELINES
from depthtrack.benchmarks.speed.isolation import in_own_process
from depthtrack.benchmarks.speed.timing import checked_seconds, time_calls
from depthtrack.benchmarks.speed.workload import CHECKED, HYPOTHESES, ROIS, Roi, Workload, make_workloads
from depthtrack.errors import DepthtrackError, InputError
from depthtrack.hand.shape import HandShape
from depthtrack.machine import Machine, describe_machine, usable_cores
from depthtrack.rendering.backends import BACKENDS, create_scorer
from depthtrack.rendering.scorer import Scorer
from depthtrack.text_table import aligned

SCORERS = (*BACKENDS, *BASELINES)
DEFAULT_SCORERS = tuple(name for name in SCORERS if name != "oracle")
"""Scorers to measure by default: all but the reference, which is slow by design."""

_BASELINE_BATCH = HYPOTHESES // 4
"""Hypotheses per call of a baseline, which renders them one at a time; four frames give 64 as well."""
_COMPILE_TIME = 120.0
"""Extra seconds for a row, for compilation on a slow machine."""


@dataclass(frozen=True)
class ScoreRow:
    """Measurements of one scorer at one resolution.

    kind: "backend", or "peer" for a baseline.
    threads: number of threads; None if the library decides.
    renderer: renderer of OpenGL; None for others.
    hypotheses_per_s, hypotheses_per_s_median: from the best and the median call of each frame.
    microseconds: microseconds per hypothesis in the best call.
    calls: number of timed calls.
    batch: hypotheses per call.
    first_call_s: seconds from the creation of the scorer, or from its first target of this size, to the first energies.
    energy_error: largest difference from the energies of the oracle.
    """

    backend: str
    kind: Literal["backend", "peer"]
    roi: Roi
    width: int
    height: int
    threads: int | None
    renderer: str | None
    hypotheses_per_s: float
    hypotheses_per_s_median: float
    microseconds: float
    calls: int
    batch: int
    first_call_s: float
    energy_error: float


@dataclass(frozen=True)
class Absent:
    """Scorer that does not run here, and the reason."""

    backend: str
    reason: str


@dataclass(frozen=True)
class ScoreReport:
    """Report of `bench score`.

    machine: the machine before the measurements.
    absent: scorers that do not run here.
    """

    benchmark: Literal["score"]
    machine: Machine
    rows: list[ScoreRow]
    absent: list[Absent]


@dataclass(frozen=True)
class ScorePlan:
    """Plan of a measurement.

    scorers: names of the scorers.
    seconds: seconds per row.
    rois: regions of interest.
    """

    scorers: tuple[str, ...]
    seconds: float
    rois: tuple[Roi, ...] = ROIS

    @property
    def row_count(self) -> int:
        """Number of rows if all scorers run."""
        return sum(len(_thread_counts(name)) for name in self.scorers) * len(self.rois)


def plan(scorers: Sequence[str] | None = None, seconds: float = 1.0) -> ScorePlan:
    """Return a plan for these scorers, or for the default ones.

    Raises:
        InputError: if a name is unknown or the time is out of range.
    """
    chosen = DEFAULT_SCORERS if scorers is None else tuple(dict.fromkeys(scorers))
    unknown = [name for name in chosen if name not in SCORERS]
    if unknown or not chosen:
        raise InputError(f"--backends takes {', '.join(SCORERS)}; found {', '.join(unknown) or 'none'}")
    return ScorePlan(chosen, checked_seconds(seconds))


def run(plan: ScorePlan, progress: Callable[[Iterator[ScoreRow]], Iterable[ScoreRow]] = iter) -> ScoreReport:
    """Return the measurements of a plan.

    progress: wraps the rows, as a progress bar does.
    """
    machine, workloads, absent = describe_machine(), make_workloads(plan.rois), list[Absent]()

    def rows() -> Iterator[ScoreRow]:
        timeout = _COMPILE_TIME + 2 * plan.seconds
        for name in plan.scorers:
            try:
                yield from in_own_process(measure, name, workloads, plan.seconds, timeout=timeout)
            except DepthtrackError as error:
                absent.append(Absent(name, str(error)))

    return ScoreReport("score", machine, list(progress(rows())), absent)


def measure(name: str, workloads: Sequence[Workload], seconds: float) -> Iterator[ScoreRow]:
    """Yield the rows of one scorer.

    Raises:
        DepthtrackError: if it does not run here.
    """
    for threads in _thread_counts(name):
        start = perf_counter()
        with _create(name, workloads[0].shape, threads) as scorer:
            for workload in workloads:
                yield _row(scorer, threads, workload, seconds, start)
                start = perf_counter()


def _thread_counts(name: str) -> list[int | None]:
    takes_threads = name in BACKENDS and "threads" in BACKENDS[name].options
    return [*sorted({1, usable_cores()})] if takes_threads else [None]


def _create(name: str, shape: HandShape, threads: int | None) -> Scorer:
    if name in BASELINES:
        return BASELINES[name](shape)
    options: dict[str, Any] = {} if threads is None else {"threads": threads}
    return create_scorer(name, shape, **options)


def _row(scorer: Scorer, threads: int | None, workload: Workload, seconds: float, start: float) -> ScoreRow:
    peer = scorer.name in BASELINES
    swarms = workload.poses[:, : _BASELINE_BATCH if peer else HYPOTHESES]
    scorer.set_target(workload.targets[0])
    scorer.score(swarms[0])
    first_call = perf_counter() - start
    best, median, calls, error = 0.0, 0.0, 0, 0.0
    for target, swarm, expected in zip(workload.targets, swarms, workload.expected, strict=True):
        scorer.set_target(target)
        error = max(error, float(np.abs(scorer.score(swarm)[:CHECKED] - expected).max()))
        durations = time_calls(partial(scorer.score, swarm), seconds / len(swarms))
        best, median, calls = best + durations.min(), median + float(np.median(durations)), calls + len(durations)
    hypotheses, camera = swarms.shape[0] * swarms.shape[1], workload.targets[0].camera
    return ScoreRow(
        backend=scorer.name,
        kind="peer" if peer else "backend",
        roi=workload.roi,
        width=camera.width,
        height=camera.height,
        threads=threads,
        renderer=getattr(scorer, "renderer", None),
        hypotheses_per_s=hypotheses / best,
        hypotheses_per_s_median=hypotheses / median,
        microseconds=best / hypotheses * 1e6,
        calls=calls,
        batch=swarms.shape[1],
        first_call_s=first_call,
        energy_error=error,
    )


def as_text(report: ScoreReport) -> str:
    """Return the report as text: the machine, one row per scorer and resolution, and notes."""
    head = ("backend", "ROI", "pixels", "threads", "best/s", "median/s", "us each", "first call", "energy off by")
    lines = [
        (
            row.backend if row.kind == "backend" else f"({row.backend})",
            row.roi,
            f"{row.width}x{row.height}",
            "-" if row.threads is None else str(row.threads),
            f"{row.hypotheses_per_s:,.0f}",
            f"{row.hypotheses_per_s_median:,.0f}",
            f"{row.microseconds:,.1f}",
            f"{row.first_call_s:.2f} s",
            f"{row.energy_error:.0e}",
        )
        for row in report.rows
    ]
    notes = {row.backend: f"{row.backend} renders with {row.renderer}" for row in report.rows if row.renderer}
    if any(row.kind == "peer" for row in report.rows):
        notes["peer"] = "(in brackets): other libraries, on a mesh of the same hand"
    return "\n".join(
        [
            report.machine.headline,
            "hypotheses per second, from pose to energy:",
            "",
            *(aligned([head, *lines], left=3) if lines else ["no scorer runs here"]),
            "",
            *notes.values(),
            *(f"{absent.backend}: {absent.reason}" for absent in report.absent),
        ]
    ).rstrip()
