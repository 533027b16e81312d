"""`depthtrack bench segment`: from an RGB-D frame to the hand's masks and depth, on one core.

A hand that was found in the frame before is followed; the search in the first frame is not timed. The point cloud with
normals, which trackers ask for when they need it, is timed apart.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from time import perf_counter
from typing import Literal

import cv2
import numpy as np

from depthtrack.errors import InputError
from depthtrack.evaluation.metrics import silhouette_iou
from depthtrack.machine import Machine, describe_machine
from depthtrack.recording import open_sequence
from depthtrack.recording.sequence import Frame
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.segmentation.skin_colour import SkinColourModel
from depthtrack.synthesis.generate import Synthesis, Synthesiser
from depthtrack.text_table import aligned
from depthtrack.types import Array, Mask

FRAMES = 12
"""Consecutive frames that are gone through again and again."""

MADE = tuple(
    Synthesis(sensor=sensor, background="room", model="skin", seed=22) for sensor in ("kinect1", "kinect2", "realsense")
)
"""A hand with forearm in a cluttered room, before every camera."""

FIRST = 200
"""Frame of these at which to begin: the hand is open, then folds a finger."""


@dataclass(frozen=True)
class Shot:
    """Some frames of a recording; `truth` (h, w) of each, None where that is not known."""

    name: str
    frames: Sequence[Frame]
    truth: Sequence[Mask | None]


@dataclass(frozen=True)
class SegmentRow:
    """One recording, with colour or by depth alone.

    Milliseconds a frame: `segment_ms` the best of each frame, `segment_ms_median` of all; `cloud_ms` and
    `cloud_ms_median` the point cloud's, of `points` on average. `iou` with the true silhouettes, None where those are
    not known; `frames` timed, over and over, in `calls`.
    """

    recording: str
    width: int
    height: int
    uses: Literal["colour and depth", "depth"]
    segment_ms: float
    segment_ms_median: float
    cloud_ms: float
    cloud_ms_median: float
    points: int
    iou: float | None
    frames: int
    calls: int


@dataclass(frozen=True)
class SegmentReport:
    """All that `bench segment` measured; `machine` as it was before."""

    benchmark: Literal["segment"]
    machine: Machine
    rows: list[SegmentRow]


@dataclass(frozen=True)
class SegmentPlan:
    """What to measure: `seconds` for each of `shots`, with colour where they have it and by depth alone."""

    shots: Sequence[Shot]
    seconds: float

    @property
    def row_count(self) -> int:
        return len(_cases(self.shots))


def plan(recordings: Sequence[Path] = (), seconds: float = 1.0) -> SegmentPlan:
    """A plan for these recordings, or synthetic ones. Raises InputError for an unusable time, or no hand to follow."""
    if not 0 < seconds <= 600:
        raise InputError(f"--seconds must lie between 0 and 600 a row, found {seconds:g}")
    return SegmentPlan([_recorded(path) for path in recordings] or [_synthetic(each) for each in MADE], seconds)


def run(plan: SegmentPlan, progress: Callable[[Iterator[SegmentRow]], Iterable[SegmentRow]] = iter) -> SegmentReport:
    """Measure; `progress` may watch the rows go by."""
    machine, threads = describe_machine(), cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        rows = (measure(shot, colour, plan.seconds) for shot, colour in _cases(plan.shots))
        return SegmentReport("segment", machine, list(progress(rows)))
    finally:
        cv2.setNumThreads(threads)


def measure(shot: Shot, use_colour: bool, seconds: float) -> SegmentRow:
    """The row of a recording. Raises InputError where no hand can be followed in it."""
    segmenter = Segmenter(SkinColourModel.default() if use_colour else None)
    durations, overlaps, points = list[Array](), list[float](), list[int]()
    for frame, truth in zip(shot.frames, shot.truth, strict=True):  # once for the compiler, and for what is found
        observation = segmenter.segment(frame)
        if observation is None:
            raise InputError(f"{shot.name}: no hand is seen in frame {frame.index}: give a recording that shows one")
        points.append(len(observation.points))
        if truth is not None:
            overlaps.append(silhouette_iou(observation.whole_mask(frame.depth.shape), truth))
    end = perf_counter() + seconds
    while not durations or perf_counter() < end:
        durations.append(_time_frames(segmenter, shot.frames))
    best, median = np.min(durations, axis=0).mean(axis=0), np.median(durations, axis=(0, 1))
    camera = shot.frames[0].camera
    return SegmentRow(
        recording=shot.name,
        width=camera.width,
        height=camera.height,
        uses="colour and depth" if use_colour else "depth",
        segment_ms=float(best[0]),
        segment_ms_median=float(median[0]),
        cloud_ms=float(best[1]),
        cloud_ms_median=float(median[1]),
        points=round(np.mean(points)),
        iou=float(np.mean(overlaps)) if overlaps else None,
        frames=len(shot.frames) - 1,
        calls=len(durations) * (len(shot.frames) - 1),
    )


def _time_frames(segmenter: Segmenter, frames: Sequence[Frame]) -> Array:
    """Milliseconds (N - 1, 2) for observation and point cloud of N frames but the first, where the hand is found."""
    segmenter.reset()
    segmenter.segment(frames[0])
    durations = []
    for frame in frames[1:]:
        begun = perf_counter()
        observation = segmenter.segment(frame)
        seen = perf_counter()
        if observation is not None:
            observation.points  # noqa: B018 (made when asked for)
        durations.append((seen - begun, perf_counter() - seen))
    return 1e3 * np.array(durations)


def _cases(shots: Sequence[Shot]) -> list[tuple[Shot, bool]]:
    """Every shot with and, which all can do, without colour."""
    return [
        (shot, colour)
        for shot, colour in product(shots, (True, False))
        if shot.frames[0].colour is not None or not colour
    ]


def _synthetic(options: Synthesis) -> Shot:
    made = Synthesiser(options)
    frames, truth = [], []
    for index in range(FIRST, FIRST + FRAMES):
        each = made[index]
        depth = each.depth.astype(np.float32)
        frames.append(Frame(index, each.timestamp, depth, each.colour, made.sensor.camera))
        truth.append(each.mask)
    return Shot(f"everyday, {options.sensor}", frames, truth)


def _recorded(path: Path) -> Shot:
    sequence = open_sequence(path)
    frames = list(sequence.frames(range(min(FRAMES, len(sequence)))))
    if len(frames) < 2:
        raise InputError(f"{path} must have two frames at least, to follow a hand in, found {len(frames)}")
    return Shot(sequence.name, frames, [sequence.hand_mask(frame.index) for frame in frames])


def as_text(report: SegmentReport) -> str:
    """The report as lines for people: the machine, a row a recording, and what is timed."""
    head = ("recording", "pixels", "uses", "ms/frame", "(median)", "cloud", "(median)", "points", "IoU")
    lines = [
        (
            row.recording,
            f"{row.width}x{row.height}",
            row.uses,
            f"{row.segment_ms:.2f}",
            f"({row.segment_ms_median:.2f})",
            f"{row.cloud_ms:.2f}",
            f"({row.cloud_ms_median:.2f})",
            f"{row.points:,}",
            "-" if row.iou is None else f"{row.iou:.3f}",
        )
        for row in report.rows
    ]
    return "\n".join(
        [
            report.machine.headline,
            "one thread, milliseconds: the best of each frame (median of all calls)",
            "",
            *aligned([head, *lines], left=3),
            "",
            "frame: the hand's silhouette and depth; cloud: points and normals of all its pixels, made when asked for",
        ]
    )
