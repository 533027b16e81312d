"""`depthtrack bench score`: from poses to energies, in hypotheses a second, for every backend and every rival.

Kinematics, rendering and the objective are all timed; setting an observation is not, as a tracker does it once a
frame. Each contender runs in a process of its own, so that its first call tells what compiling or loading costs.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from time import perf_counter
from typing import Any, Literal

import numpy as np

from depthtrack.benchmarks.speed.baselines import BASELINES
from depthtrack.benchmarks.speed.isolation import in_own_process
from depthtrack.benchmarks.speed.timing import time_calls
from depthtrack.benchmarks.speed.workload import CHECKED, HYPOTHESES, ROIS, Roi, Workload, make_workloads
from depthtrack.errors import DepthtrackError, InputError
from depthtrack.hand.shape import HandShape
from depthtrack.machine import Machine, describe_machine, usable_cores
from depthtrack.rendering.backends import BACKENDS, create_scorer
from depthtrack.rendering.scorer import Scorer
from depthtrack.text_table import aligned

SCORERS = (*BACKENDS, *BASELINES)
DEFAULT_SCORERS = tuple(name for name in SCORERS if name != "oracle")
"""Who is measured unless told otherwise: all but the reference, which is slow by design."""

_BASELINE_BATCH = HYPOTHESES // 4
"""Rivals draw one hypothesis at a time and are slow: a quarter of each frame's swarm makes 64 as well."""
_PATIENCE = 120.0
"""Seconds that a contender may take for a row on top of its time: a cold compile on a slow machine."""


@dataclass(frozen=True)
class ScoreRow:
    """One contender at one resolution.

    `kind` tells ours from rivals; `threads` None when the library decides; `renderer` what OpenGL draws with.
    `hypotheses_per_s` from the best call of each frame, `hypotheses_per_s_median` from the median one; `microseconds`
    a hypothesis, best; `calls` timed, of `batch` hypotheses each; `first_call_s` from creating the scorer, or setting
    its first observation of this size, to the first energies; `energy_error` largest difference from the oracle.
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
    """A contender that could not run, and why."""

    backend: str
    reason: str


@dataclass(frozen=True)
class ScoreReport:
    """All that `bench score` measured; `machine` as it was before."""

    benchmark: Literal["score"]
    machine: Machine
    rows: list[ScoreRow]
    absent: list[Absent]


@dataclass(frozen=True)
class ScorePlan:
    """What to measure: `specs` by name, each at every one of `rois`, `seconds` a row."""

    specs: tuple[str, ...]
    seconds: float
    rois: tuple[Roi, ...] = ROIS

    @property
    def row_count(self) -> int:
        """How many rows come of it when every contender can run."""
        return sum(len(_thread_counts(name)) for name in self.specs) * len(self.rois)


def plan(specs: Sequence[str] | None = None, seconds: float = 1.0) -> ScorePlan:
    """A plan for these contenders, or the usual ones. Raises InputError for unknown names and unusable times."""
    chosen = DEFAULT_SCORERS if specs is None else tuple(dict.fromkeys(specs))
    unknown = [name for name in chosen if name not in SCORERS]
    if unknown or not chosen:
        raise InputError(f"--backends takes {', '.join(SCORERS)}; found {', '.join(unknown) or 'none'}")
    if not 0 < seconds <= 600:
        raise InputError(f"--seconds must lie between 0 and 600 a row, found {seconds:g}")
    return ScorePlan(chosen, seconds)


def run(plan: ScorePlan, progress: Callable[[Iterator[ScoreRow]], Iterable[ScoreRow]] = iter) -> ScoreReport:
    """Measure; `progress` may watch the rows go by."""
    machine, workloads, absent = describe_machine(), make_workloads(plan.rois), list[Absent]()

    def rows() -> Iterator[ScoreRow]:
        for name in plan.specs:
            try:
                yield from in_own_process(measure, name, workloads, plan.seconds, patience=_PATIENCE + 2 * plan.seconds)
            except DepthtrackError as error:
                absent.append(Absent(name, str(error)))

    return ScoreReport("score", machine, list(progress(rows())), absent)


def measure(name: str, workloads: Sequence[Workload], seconds: float) -> Iterator[ScoreRow]:
    """Rows of one contender. Raises DepthtrackError when it cannot run here."""
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
    """The report as lines for people: the machine, a row a contender and resolution, notes, and who is absent."""
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
    notes = {row.backend: f"{row.backend} draws with {row.renderer}" for row in report.rows if row.renderer}
    if any(row.kind == "peer" for row in report.rows):
        notes["peer"] = "(in brackets): what one would use instead, on a mesh of the same hand"
    return "\n".join(
        [
            report.machine.headline,
            "hypotheses a second, from pose to energy:",
            "",
            *(aligned([head, *lines], left=3) if lines else ["nothing could run"]),
            "",
            *notes.values(),
            *(f"{absent.backend}: {absent.reason}" for absent in report.absent),
        ]
    ).rstrip()
