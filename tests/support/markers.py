"""Labelled captures from true poses, with gaps and ghosts, and columns out of order."""

import numpy as np

from depthtrack.hand.pose import transformed
from depthtrack.hand.shape import HandShape
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.filled_capture import FilledCapture, Filling
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.models.layout import load_layout
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.synthesis.motion import load_motion
from depthtrack.types import Array

RATE = 120.0
LAB = np.array([[0.0, 0, 1, 0.4], [-1, 0, 0, -0.2], [0, -1, 0, 1.1], [0, 0, 0, 1]])
"""T_capture_camera (4, 4): the capture frame has z upward and its origin on the floor."""


def body_with_markers() -> MarkerModel:
    """A rigid body of three markers."""
    offsets = np.array([[0.0, 0, 0], [0.08, 0, 0], [0, 0.05, 0.01]])
    return MarkerModel("box", ("P1", "P2", "P3"), np.zeros(3, dtype=np.int64), offsets, np.full(3, 0.001))


def labelled_hands(frames: int = 60, seed: int = 0, sides: tuple[str, ...] = ("right",)) -> LabelledCapture:
    """Hands in the motion `everyday` beside a rigid body, in a capture of shuffled trajectories.

    A gap is in every tenth part of each marker, the first hand is lost in frames 20 to 23, and a ghost flickers.
    """
    rng, times = np.random.default_rng(seed), np.arange(frames) / RATE
    models = (*(load_layout("13", HandShape(side=side)) for side in sides), body_with_markers())  # type: ignore[arg-type]
    base = transformed(load_motion("everyday").poses(times, 1), LAB)
    poses = [base + np.eye(27)[0] * 0.3 * k for k in range(len(models))]
    poses[-1][:, 7:] = 0
    true = [model.positions(pose) for model, pose in zip(models, poses, strict=True)]
    measured = [np.asarray(rng.random(points.shape[:2]) > 0.1) for points in true]
    measured[0][20:24] = False
    measured[0][21:22, 0] = True
    ghost = np.where(rng.random((frames, 1, 1)) < 0.3, rng.normal(0, 0.2, (frames, 1, 3)) + LAB[:3, 3], np.nan)
    points = [np.where(seen[..., None], at, np.nan) for at, seen in zip(true, measured, strict=True)]
    positions = np.concatenate([*points, ghost], axis=1) + rng.normal(0, 0.0003, (frames, 1, 3))
    order = np.array([rng.permutation(positions.shape[1]) for _ in range(frames)])
    shuffled = np.take_along_axis(positions, order[..., None], axis=1)
    place, start = np.argsort(order, axis=1), 0
    columns = []
    for seen in measured:
        columns.append(np.where(seen, place[:, start : start + seen.shape[1]], -1))
        start += seen.shape[1]
    poses[0][20:24] = np.nan
    capture = MarkerCapture(RATE, tuple(f"*{n + 1}" for n in range(positions.shape[1])), shuffled)
    confidence = tuple(np.where(each >= 0, rng.uniform(0.9, 1, each.shape), np.nan) for each in columns)
    return LabelledCapture(capture, models, tuple(columns), tuple(poses), confidence)


def true_hands(labelled: LabelledCapture, poses: Array) -> LabelledCapture:
    """The first hand of a capture with other poses (T, 27), as its truth."""
    columns, confidence = labelled.columns[:1], labelled.confidence[:1]
    return LabelledCapture(labelled.capture, labelled.models[:1], columns, (poses,), confidence)


def filled_hands(labelled: LabelledCapture) -> FilledCapture:
    """The capture with gaps filled from the poses, and one point of each model replaced.

    The gaps of frames without a pose stay.
    """
    expected = [model.positions(poses) for model, poses in zip(labelled.models, labelled.poses, strict=True)]
    how, positions = [], []
    for k, at in enumerate(expected):
        measured = labelled.columns[k] >= 0
        way = np.where(measured, Filling.MEASURED, np.where(np.isfinite(at[..., 0]), Filling.SMOOTHED, Filling.GAP))
        way[tuple(np.argwhere(measured)[0])] = Filling.REPLACED
        how.append(way)
        positions.append(np.where((way == Filling.MEASURED)[..., None], labelled.positions(k), at))
    errors = tuple(np.where((way != Filling.MEASURED) & (way != Filling.GAP), 0.002, np.nan) for way in how)
    return FilledCapture(labelled, tuple(positions), tuple(how), errors, labelled.poses)
