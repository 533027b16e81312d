"""The layout of the samples in a C3D file, held against its length.

Source: The C3D File Format User Guide, c3d.org, "The Header Section" and "POINT" and "TRIAL".
"""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from depthtrack.errors import InputError
from depthtrack.markers.formats.c3d_parameters import BLOCK, Parameters, floats, read_parameters, word_type
from depthtrack.markers.formats.stored_capture import check_dimensions

_HEADER_FRAMES = 0xFFFF
"""Largest number of a frame in the header."""
LARGEST_SECTION = 0xFFFF * BLOCK
"""Bytes before the samples at most: their block has a number of 16 bits."""


@dataclass(frozen=True)
class Header:
    """The numbers of the header, as written."""

    points: int
    analogs: int
    first_frame: int
    last_frame: int
    scale: float
    data_block: int
    rate: float


@dataclass(frozen=True, order=True)
class Sizes:
    """What determines the place of a sample.

    start: byte of the first one.
    frames, points: their numbers.
    analogs: analog values a frame.
    real: whether values are floats of 4 bytes, else integers of 2.
    """

    start: int
    frames: int
    points: int
    analogs: int
    real: bool

    @property
    def value_bytes(self) -> int:
        """Bytes of a value."""
        return 4 if self.real else 2

    @property
    def frame_bytes(self) -> int:
        """Bytes of a frame."""
        return (4 * self.points + self.analogs) * self.value_bytes

    def filling(self, length: int) -> "Sizes":
        """Return the sizes with the frames that fill a file of this length, if their number is 0."""
        return self if self.frames else replace(self, frames=max(length - self.start, 0) // self.frame_bytes)

    @property
    def end(self) -> int:
        """Byte after the last sample."""
        return self.start + self.frames * self.frame_bytes


@dataclass(frozen=True)
class Layout:
    """A file's sizes and parameters.

    scale: length of an integer's unit and of that of residuals, unit of the file.
    open_ended: whether the number of frames is by the length of the file, so that the last ones may be padding.
    """

    sizes: Sizes
    parameters: Parameters
    header: Header
    first_frame: int
    scale: float
    open_ended: bool
    notes: tuple[str, ...]


def read_layout(head: bytes, length: int, where: str) -> Layout:
    """Return the layout of a file of `length` bytes that begins with `head`.

    head: the file's first LARGEST_SECTION bytes.

    Raises:
        InputError: if the header or the parameters are damaged, contradict each other, or declare more samples than
            the file or a capture holds; the message states the byte.
    """
    if len(head) < 2 * BLOCK:
        raise InputError(f"{where}: expected at least {2 * BLOCK} bytes, found {len(head)}")
    section = (head[0] - 1) * BLOCK
    parameters = read_parameters(head[section:], section, where)
    header = _header(head, parameters)
    scale = parameters.number("POINT", "SCALE")
    scales = [header.scale] if scale is None else [header.scale, scale]
    counts, first_frame = _frame_counts(header, parameters)
    found = {
        Sizes(start, frames, points, analogs, real).filling(length)
        for start, frames, points, analogs, real in product(
            _blocks(header, parameters),
            counts,
            _stated(parameters.number("POINT", "USED"), header.points),
            _stated(_analogs(parameters), header.analogs),
            {value < 0 for value in scales if value != 0},
        )
        if points > 0 and analogs >= 0 and start > section
    }
    sizes, notes = _chosen(found, length, where)
    if sizes.frames > _HEADER_FRAMES:
        source = "the file is long enough for" if 0 in counts else "the parameters state"
        notes += (f"the header counts to {_HEADER_FRAMES:,}; {source} {sizes.frames:,} frames",)
    check_dimensions(sizes.frames, sizes.points, where)
    length_of_unit = scales[-1] if np.isfinite(scales[-1]) else 1.0
    return Layout(sizes, parameters, header, first_frame, abs(length_of_unit), 0 in counts, notes)


def _chosen(found: set[Sizes], length: int, where: str) -> tuple[Sizes, tuple[str, ...]]:
    """Return the sizes that header and parameters share, else the only ones that fill the file."""
    if not found:
        raise InputError(f"{where}, byte 2: the header and the parameters declare no point, scale or place of samples")
    if len(found) == 1:
        (sizes,) = found
        if sizes.end > length:
            raise InputError(
                f"{where}, byte {length}: the file ends early: {sizes.frames:,} frames of {sizes.points:,} points"
                f" need {sizes.end:,} bytes"
            )
        return sizes, ()
    filling = [sizes for sizes in found if 0 <= length - sizes.end < BLOCK]
    if len(filling) != 1:
        raise InputError(f"{where}, byte 2: the sizes in the header and in the parameters contradict each other")
    return filling[0], (
        f"the header and the parameters state different sizes; {filling[0].frames:,} frames of"
        f" {filling[0].points:,} points fill the file",
    )


def _header(head: bytes, parameters: Parameters) -> Header:
    words = np.frombuffer(head[:BLOCK], dtype=word_type(parameters.processor)).astype(np.int64).tolist()
    scale, rate = floats(head[12:16] + head[20:24], parameters.processor).tolist()
    return Header(words[1], words[2], words[3], words[4], scale, words[8], rate)


def _blocks(header: Header, parameters: Parameters) -> set[int]:
    """Return where the samples may begin, bytes."""
    stated = {header.data_block, int(parameters.number("POINT", "DATA_START") or 0)}
    return {(block - 1) * BLOCK for block in stated if 0 < block <= 0xFFFF}


def _stated(parameter: float | None, header: int) -> set[int]:
    return {header} if parameter is None else {header, int(parameter)}


def _analogs(parameters: Parameters) -> float | None:
    """Return the analog values a frame by the parameters: channels times samples a frame."""
    used, rate = parameters.number("ANALOG", "USED"), parameters.number("ANALOG", "RATE")
    point_rate = parameters.number("POINT", "RATE")
    if used is None or used == 0 or rate is None or not point_rate or not 0 < rate < 1e6 or point_rate < 0:
        return 0.0 if used == 0 else None
    return used * round(rate / point_rate)


def _frame_counts(header: Header, parameters: Parameters) -> tuple[set[int], int]:
    """Return the possible counts of frames, 0 for all of the file, and the first number.

    The header's numbers end at 65,535. Beyond it TRIAL:ACTUAL_START_FIELD and ACTUAL_END_FIELD hold them as two
    words each, low and high; POINT:LONG_FRAMES or a POINT:FRAMES of floats hold the count.
    """
    first, last = header.first_frame, header.last_frame
    trial = [parameters.numbers("TRIAL", f"ACTUAL_{which}_FIELD") for which in ("START", "END")]
    start, end = (
        int(field[0] % 65536 + 65536 * field[1]) if len(field) == 2 and np.isfinite(field).all() else 0
        for field in trial
    )
    count = int(parameters.number("POINT", "LONG_FRAMES") or parameters.number("POINT", "FRAMES") or 0)
    saturated = last == _HEADER_FRAMES and count in (0, _HEADER_FRAMES)
    if 0 < start <= end and end > _HEADER_FRAMES and (last == _HEADER_FRAMES or (end - last) % 65536 == 0):
        return {end - start + 1}, start
    if count > _HEADER_FRAMES and (last == _HEADER_FRAMES or (first + count - 1 - last) % 65536 == 0):
        return {count}, first
    if saturated:
        return {0}, first
    counts = {last - first + 1} if last >= first else set[int]()
    return counts | ({count} if count > 0 else set()), first
