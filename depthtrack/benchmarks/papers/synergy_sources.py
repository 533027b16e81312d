"""Synergies by one name, whatever they come from: a set of ours, a file, a motion's postures, or recorded ones."""

from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from depthtrack.errors import InputError
from depthtrack.hand.pose import ANGLES
from depthtrack.hand.synergies import Synergies, load_synergies, synergy_names
from depthtrack.posture_databases.registry import read_postures
from depthtrack.synthesis.generate import Synthesis, Synthesiser
from depthtrack.synthesis.motion_file import motion_names
from depthtrack.types import Array

_LABEL = 16
"""Characters."""


class SynergySource(NamedTuple):
    """Synergies, and the postures (N, 20), radians, that they were fitted to; None where only the synergies are at
    hand."""

    synergies: Synergies
    postures: Array | None


@lru_cache(maxsize=8)
def load_source(name: str) -> SynergySource:
    """The basis of this name: as `leap`, a .json of `synergies fit`, as `signs` that motion's own postures, or the path
    of recorded postures. Raises InputError for another."""
    if name in synergy_names() or Path(name).suffix == ".json":
        return SynergySource(load_synergies(name), None)
    if name in motion_names():
        postures = motion_postures(name)
    elif Path(name).exists():
        postures = read_postures(name).angles
    else:
        raise InputError(
            f"no synergies '{name}': name a set ({', '.join(synergy_names())}), or a motion to take those of its own "
            f"postures ({', '.join(motion_names())}), or give the path of a .json of synergies or of recorded postures"
        )
    return SynergySource(Synergies.fit(postures, name), postures)


def resolve_name(name: str | None, own: str) -> str:
    """The user's basis, or the experiment's own, as every worker can find it. Raises InputError where there is none."""
    name = own if name is None else name
    load_source(name)
    return str(Path(name).resolve()) if Path(name).exists() and name not in _ours() else name


def short_label(name: str) -> str:
    """The name as there is room for it beside a figure."""
    stem = Path(name).stem
    return stem if len(stem) <= _LABEL else f"{stem[: _LABEL - 3]}..."


def motion_postures(motion: str) -> Array:
    """Finger angles (N, 20), radians, of every frame of a motion."""
    return np.ascontiguousarray(Synthesiser(Synthesis(motion=motion)).poses[:, ANGLES])


def _ours() -> list[str]:
    return [*synergy_names(), *motion_names()]
