"""Opening of a recording of any format, which its content decides.

A new format is one module in `sequences/` with a subclass of BaseSequence: it is found by its presence there.
"""

from collections import deque
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.recording import sequences
from depthtrack.recording.reading import ReadingOptions
from depthtrack.recording.sequence import OnDamage, Sequence
from depthtrack.recording.sequences.base import BaseSequence

_ADVICE = {
    ".svo": "export it to MCAP or to PNG images with ZED's own tools",
    ".svo2": "export it to MCAP or to PNG images with ZED's own tools",
}
"""What to do with files that only their maker's library reads, by suffix."""
_MOST_FOLDERS = 20
"""Folders below one that is no recording that are searched for the first recording."""


def open_sequence(
    path: Path | str,
    camera: Camera | None = None,
    on_damage: OnDamage = "refuse",
    reading: ReadingOptions | None = None,
) -> Sequence:
    """Open the recording at `path`.

    camera: replaces the camera of the recording; required if it has none.
    on_damage: the action at a frame that cannot be read: "refuse" raises DamagedFrameError, "skip" adds the
        frame to `sequence.damaged`.
    reading: other choices, such as the topics of a bag.

    Raises:
        InputError: if `path` holds no recording, or one that is unusable beyond single frames.
        MissingExtraError: if the format needs a library that is not installed.
    """
    return _format_of(Path(path))(Path(path), camera, on_damage, reading)


def image_size(path: Path | str, reading: ReadingOptions | None = None) -> tuple[int, int]:
    """Return (width, height) of the depth images of a recording, without a camera.

    Raises:
        InputError: if `path` holds no recording, or no depth image can be read.
    """
    return _format_of(Path(path)).image_size(Path(path), reading)


def reading_of(sequence: Sequence) -> ReadingOptions:
    """Return how an opened recording is read."""
    return sequence.reading if isinstance(sequence, BaseSequence) else ReadingOptions()


@cache
def formats() -> tuple[type[BaseSequence], ...]:
    """Return all formats, those that accept any similar folder last."""
    modules = [import_module(f"{sequences.__name__}.{entry.name}") for entry in iter_modules(sequences.__path__)]
    found = [
        value
        for module in modules
        for value in vars(module).values()
        if isinstance(value, type)
        and issubclass(value, BaseSequence)
        and value is not BaseSequence
        and value.__module__ == module.__name__
    ]
    return tuple(sorted(found, key=lambda each: each.is_generic))


def _format_of(path: Path) -> type[BaseSequence]:
    if not path.exists():
        raise InputError(f"there is no recording at {path}: no such file or folder")
    if not path.is_dir() and not path.is_file():
        raise InputError(f"{path} must be a file or a folder, found a pipe or a device: write its content to a file")
    for candidate in formats():
        if candidate.matches(path):
            return candidate
    if (advice := _ADVICE.get(path.suffix.lower())) is not None:
        raise InputError(f"{path} has a format that only the library of its maker reads: {advice}")
    if (inner := _first_inside(path)) is not None:
        raise InputError(f"{path} is a folder of recordings, and no recording: give one of them, such as {inner}")
    names = [candidate.format_name for candidate in formats()]
    # A folder is no file that was mistaken for a recording, and the reverse.
    alike = [name for name in names if name.startswith("a folder") == path.is_dir()]
    raise InputError(f"{path} must be {' or '.join(alike or names)}, found another format")


def _first_inside(path: Path) -> Path | None:
    """Return the first recording in a folder or below it; None if the first folders hold none."""
    waiting = deque([path])
    for _ in range(_MOST_FOLDERS):
        if not waiting:
            return None
        try:
            folders = sorted(each for each in waiting.popleft().iterdir() if each.is_dir() and not each.is_symlink())
        except OSError:
            continue
        for folder in folders[:_MOST_FOLDERS]:
            if any(candidate.matches(folder) for candidate in formats() if not candidate.is_generic):
                return folder
        waiting.extend(folders[:_MOST_FOLDERS])
    return None
