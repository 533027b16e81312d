"""Harder versions of a recorded marker capture; its own labels and positions are the truth."""

from dataclasses import replace

import numpy as np

from depthtrack.errors import InputError
from depthtrack.markers.capture import UNLABELLED, MarkerCapture
from depthtrack.synthesis.marker_measurement import shuffle_points
from depthtrack.synthesis.randomness import Stream, generator

_TRIES = 100
"""Random places that are tried for each stretch to cut."""


def strip_labels(capture: MarkerCapture, seed: int) -> MarkerCapture:
    """Return the points of a capture in a random order in each frame, without labels."""
    points, _ = shuffle_points(capture.positions, seed)
    labels = tuple(f"{UNLABELLED}{n + 1}" for n in range(points.shape[1]))
    return replace(capture, labels=labels, positions=points, residuals=None)


def cut_stretches(capture: MarkerCapture, frames: tuple[int, int], share: float, seed: int) -> MarkerCapture:
    """Return a capture without stretches of its labelled trajectories.

    frames: shortest and longest stretch; the frames before and after each one are measured.
    share: of the measured labelled samples to cut, 0 to 0.5.

    Raises:
        InputError: if a number is out of range, or the capture has too few stretches that are long enough.
    """
    shortest, longest = frames
    if not 1 <= shortest <= longest <= len(capture):
        raise InputError(f"stretches must have 1 to {len(capture)} frames, found {shortest} to {longest}")
    if not 0 < share <= 0.5:
        raise InputError(f"the share to cut must be above 0 and at most 50 %, found {100 * share:g} %")
    positions, rng = capture.positions.copy(), generator(seed, 0, Stream.DROPOUTS)
    measured = np.asarray(np.isfinite(positions).all(axis=-1))
    trajectories = np.flatnonzero(capture.is_labelled & measured.any(axis=0))
    wanted, cut = share * measured[:, trajectories].sum(), 0
    while cut < wanted:
        for _ in range(_TRIES):
            column, length = rng.choice(trajectories), int(rng.integers(shortest, longest + 1))
            first = int(rng.integers(1, max(len(capture) - length, 2)))
            if first + length < len(capture) and measured[first - 1 : first + length + 1, column].all():
                break
        else:
            raise InputError(f"only {cut} of {wanted:.0f} samples can be cut in such stretches: cut a smaller share")
        positions[first : first + length, column] = np.nan
        measured[first : first + length, column] = False
        cut += length
    return replace(capture, positions=positions, residuals=None)
