"""Opening of a recording of any format.

A new format is a module with a subclass of BaseSequence and an entry in FORMATS.
"""

from pathlib import Path

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.recording.sequence import OnDamage, Sequence
from depthtrack.recording.sequences.base import BaseSequence
from depthtrack.recording.sequences.capture import CaptureSequence
from depthtrack.recording.sequences.tum import TumSequence

FORMATS: tuple[type[BaseSequence], ...] = (TumSequence, CaptureSequence)


def open_sequence(path: Path | str, camera: Camera | None = None, on_damage: OnDamage = "refuse") -> Sequence:
    """Open the recording at `path`.

    camera: replaces the camera of the recording; required if it has none.
    on_damage: the action at a frame that cannot be read: "refuse" raises DamagedFrameError, "skip" adds the
        frame to `sequence.damaged`.

    Raises:
        InputError: if `path` holds no recording, or one that is unusable beyond single frames.
    """
    return _format_of(Path(path)).open(Path(path), camera, on_damage)


def image_size(path: Path | str) -> tuple[int, int]:
    """Return (width, height) of the depth images of a recording, without a camera.

    Raises:
        InputError: if `path` holds no recording, or no depth image can be read.
    """
    return _format_of(Path(path)).image_size(Path(path))


def _format_of(path: Path) -> type[BaseSequence]:
    if not path.exists():
        raise InputError(f"there is no recording at {path}: no such file or folder")
    for candidate in FORMATS:
        if candidate.matches(path):
            return candidate
    known = " or ".join(candidate.format_name for candidate in FORMATS)
    raise InputError(f"{path} must be {known}, found another format")
