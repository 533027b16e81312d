"""A summary of a marker capture: size, gaps, motion."""

from dataclasses import dataclass

import numpy as np

from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.formats.conditioning import neighbour_distance
from depthtrack.types import Mask


@dataclass(frozen=True)
class TrajectoryGaps:
    """The gaps of a trajectory: number, longest one in frames, share of all frames.

    segments: number of runs of frames in which it was measured.
    """

    label: str
    is_labelled: bool
    gaps: int
    segments: int
    longest: int
    missing: float


@dataclass(frozen=True)
class CaptureSummary:
    """Properties of a capture. Lengths are metres, times seconds.

    labelled, unlabelled: numbers of trajectories.
    gaps, longest_gap, missing: of the labelled trajectories, of all if none is labelled; number, seconds, share. A gap
        is a run of frames without the marker, at an end of the capture too.
    segments: number of runs of frames with the marker, of the same trajectories.
    points: least, median and largest number of measured points in a frame.
    lowest, highest: corners of the box that holds all points.
    neighbours: median distance between neighbouring points; None with one point a frame.
    largest_step: of a trajectory between two frames; None if there are no two.
    residual: median of the measuring system's residuals; None if the file states none.
    unit: of the file.
    trajectories: the gaps of each.
    """

    frames: int
    first_frame: int
    rate: float
    duration: float
    labels: tuple[str, ...]
    labelled: int
    unlabelled: int
    gaps: int
    segments: int
    longest_gap: float
    missing: float
    points: tuple[int, float, int]
    lowest: tuple[float, float, float]
    highest: tuple[float, float, float]
    neighbours: float | None
    largest_step: float | None
    residual: float | None
    unit: str
    notes: tuple[str, ...]
    trajectories: tuple[TrajectoryGaps, ...]


def summarise_capture(capture: MarkerCapture) -> CaptureSummary:
    """Return the summary of a capture that has at least one measured point."""
    measured = np.asarray(np.isfinite(capture.positions).all(axis=-1))
    columns = zip(capture.labels, capture.is_labelled.tolist(), measured.T, strict=True)
    gaps = tuple(_gaps(*column) for column in columns)
    labelled = int(capture.is_labelled.sum())
    counted = [gap for gap in gaps if gap.is_labelled or not labelled]
    visible = measured.sum(axis=1)
    points = capture.positions[measured]
    steps = np.linalg.norm(np.diff(capture.positions, axis=0), axis=-1)
    neighbours = neighbour_distance(capture.positions)
    low, high = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return CaptureSummary(
        frames=len(capture),
        first_frame=capture.first_frame,
        rate=capture.rate,
        duration=len(capture) / capture.rate,
        labels=capture.labels,
        labelled=labelled,
        unlabelled=len(gaps) - labelled,
        gaps=sum(gap.gaps for gap in counted),
        segments=sum(gap.segments for gap in counted),
        longest_gap=max(gap.longest for gap in counted) / capture.rate,
        missing=float(np.mean([gap.missing for gap in counted])),
        points=(int(visible.min()), float(np.median(visible)), int(visible.max())),
        lowest=(low[0], low[1], low[2]),
        highest=(high[0], high[1], high[2]),
        neighbours=None if np.isnan(neighbours) else neighbours,
        largest_step=float(np.nanmax(steps)) if np.isfinite(steps).any() else None,
        residual=_residual(capture),
        unit=capture.unit,
        notes=capture.notes,
        trajectories=gaps,
    )


def gap_runs(measured: Mask) -> list[tuple[int, int]]:
    """Return the first frame and the length of each run of frames (T,) that were not measured."""
    edges = np.diff(np.concatenate([[False], ~measured, [False]]).astype(np.int8))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    return list(zip(starts.tolist(), (ends - starts).tolist(), strict=True))


def _gaps(label: str, is_labelled: bool, measured: Mask) -> TrajectoryGaps:
    runs = gap_runs(measured)
    longest = max((length for _, length in runs), default=0)
    return TrajectoryGaps(label, is_labelled, len(runs), len(gap_runs(~measured)), longest, float(np.mean(~measured)))


def _residual(capture: MarkerCapture) -> float | None:
    """Return the median residual; programs without residuals write 0 throughout."""
    if capture.residuals is None or not np.nan_to_num(capture.residuals).any():
        return None
    return float(np.nanmedian(capture.residuals))
