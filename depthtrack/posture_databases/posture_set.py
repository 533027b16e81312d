"""What every reader of postures returns, and what all of them refuse."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from depthtrack.errors import InputError
from depthtrack.types import Array

MAX_POSTURES = 500_000
"""Most postures read from one file: over an hour at 100 Hz, and a bound on memory."""
MAX_BYTES = 1 << 28
"""Largest text file read."""


@dataclass(frozen=True)
class PostureSet:
    """Recorded postures: `angles` (N, 20) radians, in the order of the pose vector.

    Where joint positions were recorded, `misfit` is their mean distance in metres (root mean square over a hand's
    joints) from the hand fitted to them. `tracks` (N,) names the track each posture is from, where they have names.
    """

    angles: Array
    misfit: float | None = None
    tracks: NDArray[np.str_] | None = None

    def only(self, names: Collection[str]) -> Self:
        """The postures of the tracks so named. Raises InputError for a name that no track has."""
        tracks = np.zeros(len(self.angles), dtype=np.str_) if self.tracks is None else self.tracks
        known = sorted({str(name) for name in tracks} - {""})
        for name in names:
            if name not in known:
                raise InputError(f"no track is named '{name}': there {_there_are(known)}")
        chosen = np.isin(tracks, list(names))
        return replace(self, angles=self.angles[chosen], tracks=tracks[chosen])


def check_angles(path: Path, angles: Array) -> Array:
    """The angles (N, 20), if they can be radians. Raises InputError."""
    if not len(angles):
        raise InputError(f"{path} holds no posture")
    largest = float(np.abs(angles).max())
    if not largest <= np.pi:
        raise InputError(
            f"{path}: joint angles must be radians between -pi and pi, found {largest:.4g}; a CSV of degrees "
            "has columns named like index_pip_flexion_deg"
        )
    return angles


def check_count(path: Path, count: int) -> None:
    """Raise InputError for more postures than are read from one file."""
    if count > MAX_POSTURES:
        raise InputError(f"{path} holds more than {MAX_POSTURES:,} postures: keep every tenth, they are much alike")


def _there_are(names: list[str]) -> str:
    return f"are {', '.join(names)}" if names else "are no names of tracks"
