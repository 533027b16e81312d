"""C3D, the binary format of biomechanics, through ezc3d.

Source: The C3D File Format User Guide, c3d.org.
"""

from pathlib import Path
from typing import Any

import numpy as np

from depthtrack.errors import InputError, MissingExtraError
from depthtrack.markers.formats.stored_capture import CaptureFormat, StoredCapture, check_dimensions

_KEY = 0x50
"""Second byte of every C3D file."""


def matches(head: bytes) -> bool:
    """Return whether the file begins with the block of its parameters and the key of C3D."""
    return len(head) >= 512 and head[0] >= 2 and head[1] == _KEY


def read(path: Path) -> StoredCapture:
    """Read a file.

    Raises:
        InputError: if it is damaged; the message states the byte.
        MissingExtraError: if ezc3d is not installed.
    """
    try:
        contents = _ezc3d().c3d(str(path))
    except (OSError, RuntimeError, ValueError, IndexError, MemoryError) as error:
        raise InputError(f"cannot read {path}: damaged C3D, {str(error)[:80]}") from error
    points = contents["parameters"]["POINT"]
    positions = np.ascontiguousarray(contents["data"]["points"][:3].transpose(2, 1, 0))
    check_dimensions(len(positions), positions.shape[1], str(path))
    residuals = contents["data"]["meta_points"]["residuals"][0].T
    units = points.get("UNITS", {"value": []})["value"]
    return StoredCapture(
        tuple(points["LABELS"]["value"]),
        positions,
        float(points["RATE"]["value"][0]),
        str(units[0]) if len(units) else None,
        np.ascontiguousarray(residuals),
        int(contents["header"]["points"]["first_frame"]) + 1,
    )


def _ezc3d() -> Any:
    try:
        import ezc3d
    except ModuleNotFoundError as error:
        raise MissingExtraError("C3D", "markers") from error
    return ezc3d


FORMAT = CaptureFormat("C3D", (".c3d",), matches, read)
