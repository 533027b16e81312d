"""Reading of a posture database of any format.

A new format is a module with `matches` and `read`, and an entry in FORMATS.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from depthtrack.errors import InputError
from depthtrack.posture_databases import joint_arrays, mat, tables
from depthtrack.posture_databases.posture_set import PostureSet


@dataclass(frozen=True)
class PostureFormat:
    """A format: its description, the test of a path, and the reader."""

    description: str
    matches: Callable[[Path], bool]
    read: Callable[[Path], PostureSet]


FORMATS = (
    PostureFormat("a .mat text file of 26 columns", mat.matches, mat.read),
    PostureFormat("a .csv of angles or joints, or a folder with one", tables.matches, tables.read),
    PostureFormat("a .npz of joints", joint_arrays.matches, joint_arrays.read),
)


def read_postures(path: Path | str) -> PostureSet:
    """Return the postures of a file or folder.

    Raises:
        InputError: if there are none, or they cannot be read.
    """
    path = Path(path)
    if not path.exists():
        raise InputError(f"there are no postures at {path}: no such file or folder")
    for candidate in FORMATS:
        if candidate.matches(path):
            return candidate.read(path)
    known = ", ".join(candidate.description for candidate in FORMATS)
    raise InputError(f"{path} must hold postures in a known format: expected {known}")
