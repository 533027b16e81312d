"""`depthtrack bench markers`: measure online labelling on one core.

It runs from points to labels and poses.

A frame is one call of the tracker: prediction, assignment, pose fit and status of all models. The captures are
synthetic: 200 Hz, 0.5 mm noise, dropouts and ghosts. The settings are those of Maycock et al. 2015, Sec. V.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import product
from time import perf_counter
from typing import Literal

import numpy as np

from depthtrack.benchmarks.speed.timing import checked_seconds
from depthtrack.machine import Machine, describe_machine
from depthtrack.markers.labelling.options import PAPER_LABELLING, LabellingOptions
from depthtrack.markers.labelling.tracker import MarkerTracker
from depthtrack.synthesis.marker_capture import MarkerSynthesis, SyntheticMarkers, synthesise_markers
from depthtrack.text_table import aligned
from depthtrack.types import Array

FRAMES = 400
SCENES: dict[str, tuple[MarkerSynthesis, float]] = {
    "one hand": (MarkerSynthesis(start=10.0, frames=FRAMES, seed=1), 75.0),
    "two hands, three rigid bodies": (
        MarkerSynthesis(
            layout="13", two_hands=True, rigid_bodies=3, rigid_markers=3, start=10.0, frames=FRAMES, seed=1
        ),
        35.0,
    ),
}
"""Captures, and the frames a second that Maycock et al. 2015, Sec. V, state for their like."""
METHODS: dict[str, LabellingOptions] = {"default": LabellingOptions(), "paper": PAPER_LABELLING}


@dataclass(frozen=True)
class MarkersRow:
    """Measurements of one scene and method.

    markers: of all models.
    points: mean number in a frame.
    frames_per_s, frames_per_s_median: from the best and the median pass over the capture.
    frame_us, frame_us_median: microseconds a frame, the same.
    slowest_us: best time of the slowest frame, microseconds.
    right: share of the samples of markers that have their true label.
    paper_frames_per_s: that Maycock et al. 2015 state.
    passes: timed passes over the capture.
    """

    scene: str
    method: str
    markers: int
    points: float
    frames_per_s: float
    frames_per_s_median: float
    frame_us: float
    frame_us_median: float
    slowest_us: float
    right: float
    paper_frames_per_s: float
    passes: int


@dataclass(frozen=True)
class MarkersReport:
    """Report of `bench markers`.

    machine: the machine before the measurements.
    """

    benchmark: Literal["markers"]
    machine: Machine
    rows: list[MarkersRow]


@dataclass(frozen=True)
class MarkersPlan:
    """Plan of a measurement: `seconds` for each row."""

    seconds: float

    @property
    def row_count(self) -> int:
        """Number of rows."""
        return len(SCENES) * len(METHODS)


def plan(seconds: float = 1.0) -> MarkersPlan:
    """Return a plan.

    Raises:
        InputError: if the time is out of range.
    """
    return MarkersPlan(checked_seconds(seconds))


def run(plan: MarkersPlan, progress: Callable[[Iterator[MarkersRow]], Iterable[MarkersRow]] = iter) -> MarkersReport:
    """Return the measurements of a plan.

    progress: wraps the rows, as a progress bar does.
    """
    machine = describe_machine()
    rows = (measure(scene, method, plan.seconds) for scene, method in product(SCENES, METHODS))
    return MarkersReport("markers", machine, list(progress(rows)))


def measure(scene: str, method: str, seconds: float) -> MarkersRow:
    """Return the row of a scene and method."""
    options, stated = SCENES[scene]
    made = synthesise_markers(options)
    points = [made.capture.points(t)[0] for t in range(len(made.capture))]
    right = _share_right(made, METHODS[method])
    end, passes = perf_counter() + seconds, list[Array]()
    while not passes or perf_counter() < end:
        passes.append(_time_frames(made, METHODS[method], points))
    best, totals = np.min(passes, axis=0), np.mean(passes, axis=1)
    return MarkersRow(
        scene=scene,
        method=method,
        markers=sum(len(model.labels) for model in made.truth.models),
        points=float(np.mean([len(each) for each in points])),
        frames_per_s=float(1 / totals.min()),
        frames_per_s_median=float(1 / np.median(totals)),
        frame_us=float(1e6 * totals.min()),
        frame_us_median=float(1e6 * np.median(totals)),
        slowest_us=float(1e6 * best.max()),
        right=right,
        paper_frames_per_s=stated,
        passes=len(passes),
    )


def _tracker(made: SyntheticMarkers, options: LabellingOptions) -> MarkerTracker:
    starts = [poses[0] for poses in made.truth.poses]
    return MarkerTracker(made.truth.models, made.capture.rate, options, starts)


def _share_right(made: SyntheticMarkers, options: LabellingOptions) -> float:
    """Return the share of samples with their true label; this pass compiles the kernels."""
    tracker, right, total = _tracker(made, options), 0, 0
    for t in range(len(made.capture)):
        points, columns = made.capture.points(t)
        for found, truth in zip(tracker.update(points).points, made.truth.columns, strict=True):
            given = np.where(found >= 0, columns[found], -1)
            total += int((truth[t] >= 0).sum())
            right += int(((truth[t] >= 0) & (given == truth[t])).sum())
    return right / total


def _time_frames(made: SyntheticMarkers, options: LabellingOptions, points: list[Array]) -> Array:
    """Return the time (T,) of each frame, seconds."""
    tracker, durations = _tracker(made, options), np.empty(len(points))
    for t, each in enumerate(points):
        begun = perf_counter()
        tracker.update(each)
        durations[t] = perf_counter() - begun
    return durations


def as_text(report: MarkersReport) -> str:
    """Return the report as text: the machine, a row per scene and method, and notes."""
    head = ("scene", "method", "markers", "points", "frames/s", "(median)", "us/frame", "slowest", "right", "paper")
    lines = [
        (
            row.scene,
            row.method,
            f"{row.markers}",
            f"{row.points:.1f}",
            f"{row.frames_per_s:,.0f}",
            f"({row.frames_per_s_median:,.0f})",
            f"{row.frame_us:.0f}",
            f"{row.slowest_us:.0f}",
            f"{100 * row.right:.2f}%",
            f"{row.paper_frames_per_s:.0f}",
        )
        for row in report.rows
    ]
    return "\n".join(
        [
            report.machine.headline,
            "one thread, online: best pass over the capture (median pass)",
            "",
            *aligned([head, *lines], left=2),
            "",
            "right: samples with their true label; paper: frames/s that Maycock et al. 2015 state for such a scene",
        ]
    )
