"""`depthtrack bench segment`: measure the segmentation of RGB-D frames on one core.

The hand is followed from the frame before; its detection in the first frame is not timed. The point cloud with normals
is timed separately, since not all trackers need it.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from time import perf_counter
from typing import Literal

import cv2
import numpy as np

from depthtrack.benchmarks.speed.timing import checked_seconds
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
"""Number of consecutive frames, which are segmented repeatedly."""

MADE = tuple(
    Synthesis(sensor=sensor, background="room", model="skin", seed=22) for sensor in ("kinect1", "kinect2", "realsense")
)
"""Synthetic recordings of each camera: a hand with forearm in a cluttered room."""

FIRST = 200
"""First frame of the synthetic recordings, in which the hand is open and then bends a finger."""


@dataclass(frozen=True)
class Shot:
    """Frames of a recording.

    truth: (h, w) true silhouette of each frame; None if unknown.
    """

    name: str
    frames: Sequence[Frame]
    truth: Sequence[Mask | None]


@dataclass(frozen=True)
class SegmentRow:
    """Measurements of one recording, with colour or with depth alone.

    segment_ms, segment_ms_median: milliseconds per frame of the segmentation, best calls and median call.
    cloud_ms, cloud_ms_median: milliseconds per frame of the point cloud, best calls and median call.
    points: mean number of points.
    iou: mean IoU with the true silhouettes; None if they are unknown.
    frames: number of timed frames.
    calls: number of timed calls.
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
    """Report of `bench segment`.

    machine: the machine before the measurements.
    """

    benchmark: Literal["segment"]
    machine: Machine
    rows: list[SegmentRow]


@dataclass(frozen=True)
class SegmentPlan:
    """Plan of a measurement: `seconds` for each shot with colour and with depth alone."""

    shots: Sequence[Shot]
    seconds: float

    @property
    def row_count(self) -> int:
        """Number of rows."""
        return len(_cases(self.shots))


def plan(recordings: Sequence[Path] = (), seconds: float = 1.0) -> SegmentPlan:
    """Return a plan for these recordings, or for synthetic ones.

    Raises:
        InputError: if the time is out of range, or a recording is unusable or too short.
    """
    seconds = checked_seconds(seconds)
    return SegmentPlan([_recorded(path) for path in recordings] or [_synthetic(each) for each in MADE], seconds)


def run(plan: SegmentPlan, progress: Callable[[Iterator[SegmentRow]], Iterable[SegmentRow]] = iter) -> SegmentReport:
    """Return the measurements of a plan.

    progress: wraps the rows, as a progress bar does.
    """
    machine, threads = describe_machine(), cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        rows = (measure(shot, colour, plan.seconds) for shot, colour in _cases(plan.shots))
        return SegmentReport("segment", machine, list(progress(rows)))
    finally:
        cv2.setNumThreads(threads)


def measure(shot: Shot, use_colour: bool, seconds: float) -> SegmentRow:
    """Return the row of a recording.

    Raises:
        InputError: if a frame shows no hand.
    """
    segmenter = Segmenter(SkinColourModel.default() if use_colour else None)
    durations, overlaps, points = list[Array](), list[float](), list[int]()
    # The first pass compiles the kernels and measures the overlap.
    for frame, truth in zip(shot.frames, shot.truth, strict=True):
        observation = segmenter.segment(frame)
        if observation is None:
            raise InputError(f"{shot.name}: frame {frame.index} shows no hand: give a recording with a hand")
        points.append(observation.reading_count)
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
    """Return milliseconds (N - 1, 2) of segmentation and point cloud, without the first frame."""
    segmenter.reset()
    segmenter.segment(frames[0])
    durations = []
    for frame in frames[1:]:
        begun = perf_counter()
        observation = segmenter.segment(frame)
        segmented = perf_counter()
        if observation is not None:
            observation.points  # noqa: B018 (computes the point cloud)
        durations.append((segmented - begun, perf_counter() - segmented))
    return 1e3 * np.array(durations)


def _cases(shots: Sequence[Shot]) -> list[tuple[Shot, bool]]:
    """Return each shot with colour, if it has colour, and without."""
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
        raise InputError(f"{path} must have at least two frames, found {len(frames)}: give a longer recording")
    return Shot(sequence.name, frames, [sequence.hand_mask(frame.index) for frame in frames])


def as_text(report: SegmentReport) -> str:
    """Return the report as text: the machine, two rows per recording, and notes."""
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
            "one thread, milliseconds: best calls (median)",
            "",
            *aligned([head, *lines], left=3),
            "",
            "frame: silhouette and depth of the hand; cloud: points and normals of all its pixels",
        ]
    )
