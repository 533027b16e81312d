"""Load synergies by name: of an included set, a file, a motion, or recorded postures."""

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
"""Largest number of characters in a label."""


class SynergySource(NamedTuple):
    """Synergies and their postures.

    postures: (N, 20) finger angles of the fit, rad; None if they are not stored with the synergies.
    """

    synergies: Synergies
    postures: Array | None


@lru_cache(maxsize=8)
def load_source(name: str) -> SynergySource:
    """Return the synergies of a name.

    name: an included set, as `leap`; a motion, as `signs`, for its postures; a .json from `synergies fit`; or the path
        of recorded postures.

    Raises:
        InputError: if there are no synergies of this name.
    """
    if name in synergy_names() or Path(name).suffix == ".json":
        return SynergySource(load_synergies(name), None)
    if name in motion_names():
        postures = motion_postures(name)
    elif Path(name).exists():
        postures = read_postures(name).angles
    else:
        raise InputError(
            f"there are no synergies '{name}': give a set ({', '.join(synergy_names())}), a motion "
            f"({', '.join(motion_names())}), a .json of synergies, or a path of recorded postures"
        )
    return SynergySource(Synergies.fit(postures, name), postures)


def resolve_name(name: str | None, own: str) -> str:
    """Return the name of the user's synergies, or of the experiment's, with an absolute path.

    Raises:
        InputError: if there are no synergies of this name.
    """
    name = own if name is None else name
    load_source(name)
    return str(Path(name).resolve()) if Path(name).exists() and name not in _included() else name


def short_label(name: str) -> str:
    """Return the name, shortened for labels."""
    stem = Path(name).stem
    return stem if len(stem) <= _LABEL else f"{stem[: _LABEL - 3]}..."


def motion_postures(motion: str) -> Array:
    """Return the finger angles (N, 20) of all frames of a motion, rad."""
    return np.ascontiguousarray(Synthesiser(Synthesis(motion=motion)).poses[:, ANGLES])


def _included() -> list[str]:
    return [*synergy_names(), *motion_names()]
