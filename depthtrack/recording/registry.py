"""Opens a recording, whatever its format. A new format is one more module and one more line in FORMATS."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.recording.sequence import OnDamage, Sequence
from depthtrack.recording.sequences import tum as folder


@dataclass(frozen=True)
class Format:
    """How one kind of recording is told from the others, measured and opened."""

    description: str
    matches: Callable[[Path], bool]
    image_size: Callable[[Path], tuple[int, int]]
    open: Callable[[Path, Camera | None, OnDamage], Sequence]


FORMATS = (
    Format(
        description="a folder with depth.txt (TUM RGB-D layout)",
        matches=lambda path: (path / "depth.txt").exists(),
        image_size=folder.image_size,
        open=folder.FolderSequence,
    ),
)


def open_sequence(path: Path | str, camera: Camera | None = None, on_damage: OnDamage = "refuse") -> Sequence:
    """Open the recording at `path`.

    `camera` replaces the recording's own, and is needed where it has none. `on_damage` says what iteration does at a
    frame that cannot be read: "refuse" raises DamagedFrameError, "skip" notes it in `sequence.damaged` and goes on.
    Raises InputError when there is no recording at `path` or anything but single frames is wrong with it.
    """
    return _format_of(Path(path)).open(Path(path), camera, on_damage)


def image_size(path: Path | str) -> tuple[int, int]:
    """(width, height) of the recording's depth images, known before its camera is. Raises InputError."""
    return _format_of(Path(path)).image_size(Path(path))


def _format_of(path: Path) -> Format:
    if not path.exists():
        raise InputError(f"there is no recording at {path}: no such file or folder")
    for candidate in FORMATS:
        if candidate.matches(path):
            return candidate
    known = " or ".join(candidate.description for candidate in FORMATS)
    raise InputError(f"{path} is no recording depthtrack knows: expected {known}")
