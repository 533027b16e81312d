"""C3D, the binary format of biomechanics.

Sizes are checked against the file's length before any sample is read.
Source: The C3D File Format User Guide, c3d.org.
"""

from pathlib import Path

import numpy as np

from depthtrack.errors import InputError
from depthtrack.files import check_size, open_regular
from depthtrack.markers.formats.c3d_layout import LARGEST_SECTION, Layout, read_layout
from depthtrack.markers.formats.c3d_parameters import floats, word_type
from depthtrack.markers.formats.c3d_writing import write
from depthtrack.markers.formats.stored_capture import FARTHEST, CaptureFormat, StoredCapture
from depthtrack.types import Array

MAX_BYTES = 1 << 34
"""Largest file read; the samples of markers alone are held in memory."""
_KEY = 0x50
"""Second byte of every C3D file."""
_OTHER_POINTS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS")
"""Parameters of POINT that list trajectories that are no positions."""
_CHUNK = 1 << 24
"""Bytes decoded at a time."""


def matches(head: bytes) -> bool:
    """Return whether the file begins with the block of its parameters and the key of C3D."""
    return len(head) >= 512 and head[0] >= 2 and head[1] == _KEY


def read(path: Path) -> StoredCapture:
    """Read a file.

    Raises:
        InputError: if it is damaged; the message states the byte.
    """
    check_size(path, MAX_BYTES)
    length = path.stat().st_size
    with open_regular(path) as file:
        head = file.read(LARGEST_SECTION)
    layout = read_layout(head, length, str(path))
    positions, residuals = _samples(path, layout)
    if layout.open_ended:
        frames = _without_padding(positions, residuals)
        positions, residuals = positions[:frames], residuals[:frames]
    parameters = layout.parameters
    labels = parameters.strings("POINT", "LABELS")
    others = {label for name in _OTHER_POINTS for label in parameters.strings("POINT", name)} - {""}
    kept = [k for k in range(layout.sizes.points) if k >= len(labels) or labels[k] not in others]
    notes = layout.notes
    if len(kept) < layout.sizes.points:
        notes += (f"{layout.sizes.points - len(kept)} trajectories are angles, forces or powers and are left out",)
        labels = tuple(labels[k] if k < len(labels) else "" for k in kept)
        positions, residuals = positions[:, kept], residuals[:, kept]
    rate = parameters.number("POINT", "RATE") or layout.header.rate
    unit = next(filter(None, parameters.strings("POINT", "UNITS")), None)
    return StoredCapture(
        labels, positions, rate if rate > 0 else None, unit, residuals, max(layout.first_frame, 1), notes
    )


def _samples(path: Path, layout: Layout) -> tuple[Array, Array]:
    """Return positions (T, M, 3) and residuals (T, M), unit of the file; residual -1 in gaps."""
    sizes = layout.sizes
    positions, residuals = np.empty((sizes.frames, sizes.points, 3)), np.empty((sizes.frames, sizes.points))
    width = sizes.value_bytes
    stored = np.memmap(path, np.uint8, "r", sizes.start, (sizes.frames, sizes.frame_bytes))
    step = max(1, _CHUNK // sizes.frame_bytes)
    for first in range(0, sizes.frames, step):
        chunk = slice(first, first + step)
        values = _values(stored[chunk, : 4 * width * sizes.points].tobytes(), layout).reshape(-1, sizes.points, 4)
        positions[chunk] = values[..., :3] if sizes.real else values[..., :3] * layout.scale
        # The high byte has the cameras, the low one the residual; both together are below 0 in a gap.
        fourth = np.nan_to_num(values[..., 3].clip(-1, 0x7FFF), nan=-1).astype(np.int64)
        residuals[chunk] = np.where(fourth < 0, -1, (fourth & 0xFF) * layout.scale)
        wrong = np.argwhere((np.abs(positions[chunk]) > FARTHEST) & (residuals[chunk] >= 0)[..., None])
        if len(wrong):
            frame, point, axis = (wrong[0] + (first, 0, 0)).tolist()
            byte = sizes.start + frame * sizes.frame_bytes + (4 * point + axis) * width
            found = positions[frame, point, axis]
            raise InputError(f"{path}, byte {byte}: expected a coordinate below {FARTHEST:g}, found {found:.3g}")
    return positions, residuals


def _values(data: bytes, layout: Layout) -> Array:
    processor = layout.parameters.processor
    if layout.sizes.real:
        return floats(data, processor)
    return np.frombuffer(data, word_type(processor).replace("u", "i")).astype(np.float64)


def _without_padding(positions: Array, residuals: Array) -> int:
    """Return the number of frames up to the last one that is not zero throughout."""
    written = (positions != 0).any(axis=(1, 2)) | (residuals != 0).any(axis=1)
    return int(np.flatnonzero(written)[-1]) + 1 if written.any() else 1


FORMAT = CaptureFormat("C3D", (".c3d",), matches, read, write)
