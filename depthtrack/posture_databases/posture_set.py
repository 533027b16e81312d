"""The result of all posture readers, and the checks that they share."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from depthtrack.errors import InputError
from depthtrack.types import Array

MAX_POSTURES = 500_000
"""Largest number of postures in a file: over an hour at 100 Hz, and a bound on memory."""
MAX_BYTES = 1 << 28
"""Largest file read."""


@dataclass(frozen=True)
class PostureSet:
    """Recorded postures.

    angles: (N, 20) radians, in the order of the pose vector.
    misfit: mean distance, metres, of recorded joints from the fitted hand (root mean square over a hand's joints);
        None if angles were recorded.
    tracks: (N,) name of the track of each posture; None if tracks have no names.
    """

    angles: Array
    misfit: float | None = None
    tracks: NDArray[np.str_] | None = None

    def only(self, names: Collection[str]) -> Self:
        """Return the postures of the tracks with these names.

        Raises:
            InputError: if no track has one of the names.
        """
        tracks = np.zeros(len(self.angles), dtype=np.str_) if self.tracks is None else self.tracks
        known = sorted({str(name) for name in tracks} - {""})
        for name in names:
            if name not in known:
                choices = f"choose among {', '.join(known)}" if known else "the tracks have no names"
                raise InputError(f"no track is named '{name}': {choices}")
        chosen = np.isin(tracks, list(names))
        return replace(self, angles=self.angles[chosen], tracks=tracks[chosen])


def check_angles(path: Path, angles: Array) -> Array:
    """Return the angles (N, 20) after a check that they can be radians.

    Raises:
        InputError: if there is no posture, or an angle lies outside -pi to pi.
    """
    if not len(angles):
        raise InputError(f"{path} must hold one or more postures, found none")
    largest = float(np.abs(angles).max())
    if not largest <= np.pi:
        raise InputError(
            f"{path}: joint angles must be radians between -pi and pi, found {largest:.4g}; a CSV of degrees "
            "has columns named like index_pip_flexion_deg"
        )
    return angles


def check_count(path: Path, count: int) -> None:
    """Check the number of postures.

    Raises:
        InputError: if the file holds more than `MAX_POSTURES`.
    """
    if count > MAX_POSTURES:
        raise InputError(f"{path} holds more than {MAX_POSTURES:,} postures: keep every tenth")
