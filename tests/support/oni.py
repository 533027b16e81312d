"""Files of OpenNI, written record by record as its recorder writes them."""

import struct
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Depths = list[NDArray[np.uint16]]


def compress16z(values: NDArray[np.uint16]) -> bytes:
    """Return the compression 16z, written value by value."""
    flat = [int(value) for value in values.ravel()]
    out, half, zeros = bytearray(struct.pack("<H", flat[0])), None, 0

    def flush_zeros() -> None:
        nonlocal zeros
        if zeros:
            out.append(0xE0 + zeros)
            zeros = 0

    for last, value in pairwise(flat):
        fall = last - value
        if abs(fall) <= 6:
            if half is None:
                half = fall + 6
                continue
            code, half = 16 * half + fall + 6, None
            if code == 0x66:
                zeros += 1
                if zeros == 15:
                    flush_zeros()
            else:
                flush_zeros()
                out.append(code)
            continue
        flush_zeros()
        out.append(0xFF if half is None else 16 * half + 0xF)
        half = None
        out += bytes([fall + 192]) if abs(fall) <= 63 else struct.pack(">H", value)
    if half is not None:
        out.append(16 * half + 0xD)
    flush_zeros()
    return bytes(out)


def compress16z_with_table(values: NDArray[np.uint16]) -> bytes:
    """Return the compression 16z of the rows of a table, with the table in front."""
    table, rows = np.unique(values, return_inverse=True)
    return struct.pack("<H", len(table)) + table.astype("<u2").tobytes() + compress16z(rows.astype(np.uint16))


CODECS: dict[bytes, Callable[[NDArray[np.uint16]], bytes]] = {
    b"16zT": compress16z_with_table,
    b"16zP": compress16z,
    b"NONE": lambda values: values.astype("<u2").tobytes(),
}


def write_oni(
    path: Path,
    depths: Depths,
    times: list[int] | None = None,
    codec: bytes = b"16zT",
    field_of_view: tuple[float, float] | None = (1.0, 0.8),
    pixel_format: int = 100,
    version: tuple[int, int, int] = (1, 0, 1),
    frames: list[bytes] | None = None,
) -> Path:
    """depths (h, w) in units of `pixel_format`; times in microseconds; frames: stored data."""
    link = "<Q" if version >= (1, 0, 1) else "<I"

    def record(kind: int, node: int, fields: bytes = b"", data: bytes = b"") -> bytes:
        size = 20 + struct.calcsize(link) + len(fields)
        return struct.pack("<4s4I", b"NIR\0", kind, node, size, len(data)) + struct.pack(link, 0) + fields + data

    def text(value: bytes) -> bytes:
        return struct.pack("<I", len(value) + 1) + value + b"\0"

    def property_of(kind: int, node: int, name: bytes, value: bytes) -> bytes:
        return record(kind, node, text(name) + struct.pack("<I", len(value)) + value)

    height, width = depths[0].shape
    counts = struct.pack("<I2Q", len(depths), 0, 0) + struct.pack(link, 0)
    out = struct.pack("<4s2BHIQI", b"NI10", *version, 0, 0, 2)
    out += record(0x0D, 1, text(b"Color") + struct.pack("<I4s", 3, b"JPEG") + counts)
    out += record(0x0D, 2, text(b"Depth") + struct.pack("<I4s", 2, codec) + counts)
    out += property_of(6, 1, b"xnMapOutputMode", struct.pack("<3I", 99, 98, 30))
    out += property_of(6, 2, b"xnMapOutputMode", struct.pack("<3I", width, height, 30))
    out += property_of(3, 2, b"oniPixelFormat", struct.pack("<Q", pixel_format))
    if field_of_view is not None:
        out += property_of(6, 2, b"xnFOV", struct.pack("<2d", *field_of_view))
    out += record(0x09, 2) + record(0x08, 2, struct.pack("<IQ", 0, 0))
    for number, depth in enumerate(depths):
        time = 33_333 * number if times is None else times[number]
        data = CODECS[codec](depth) if frames is None else frames[number]
        out += record(0x0A, 1, struct.pack("<QI", time, number + 1), b"\xff\xd8 a picture \xff\xd9")
        out += record(0x0A, 2, struct.pack("<QI", time, number + 1), data)
    path.write_bytes(out + record(0x07, 2) + record(0x0B, 0))
    return path
