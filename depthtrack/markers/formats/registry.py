"""Reading and writing of captures in any format.

A new format is a module with a `CaptureFormat` and an entry in FORMATS.
"""

from pathlib import Path

import numpy as np

from depthtrack.errors import InputError
from depthtrack.files import open_regular
from depthtrack.markers.capture import MarkerCapture
from depthtrack.markers.formats import c3d, motive_csv, plain_csv, qualisys_tsv, trc, vicon_csv
from depthtrack.markers.formats.conditioning import to_capture
from depthtrack.markers.formats.stored_capture import CaptureFormat

FORMATS: tuple[CaptureFormat, ...] = (
    c3d.FORMAT,
    qualisys_tsv.FORMAT,
    vicon_csv.FORMAT,
    motive_csv.FORMAT,
    trc.FORMAT,
    plain_csv.FORMAT,
)
_HEAD = 1 << 16
"""Bytes by which a format is found."""


def read_capture(path: Path | str, rate: float | None = None, unit: str | None = None) -> MarkerCapture:
    """Read a capture; its format is found by its content.

    rate: Hz, in place of that of the file; 120 Hz if neither states one.
    unit: m, cm or mm, in place of that of the file, or of the one that fits the size of the hand.

    Raises:
        InputError: if the file is missing, damaged, too large, of no known format, or has no sample.
    """
    path = Path(path)
    capture = to_capture(find_format(path).read(path), rate, unit)
    if not np.isfinite(capture.positions).any():
        raise InputError(f"{path} holds no measured point: every sample is a gap")
    return capture


def write_capture(path: Path | str, capture: MarkerCapture) -> None:
    """Write a capture in the format that the suffix of `path` names.

    Raises:
        InputError: if no format has this suffix, the format cannot hold the capture, or the file cannot be written.
    """
    path = Path(path)
    for candidate in FORMATS:
        if candidate.write is not None and path.suffix.lower() in candidate.suffixes:
            candidate.write(path, capture)
            return
    known = [suffix for candidate in FORMATS if candidate.write is not None for suffix in candidate.suffixes]
    raise InputError(f"a capture must end in {', '.join(known)}, found '{path.name}'")


def find_format(path: Path) -> CaptureFormat:
    """Return the format of a file. Raises InputError if it is missing or of no known format."""
    if path.exists() and not path.is_file():
        raise InputError(f"{path} must be a file of a capture, found a folder or a device")
    if not path.exists():
        raise InputError(f"there is no capture at {path}: no such file")
    with open_regular(path) as file:
        head = file.read(_HEAD).removeprefix(b"\xef\xbb\xbf")
    if not head:
        raise InputError(f"{path} must hold a capture, found an empty file")
    for candidate in FORMATS:
        if candidate.matches(head):
            return candidate
    known = " or ".join(candidate.description for candidate in FORMATS)
    raise InputError(f"{path} must be {known}, found another format")
