"""Arrays of `.npy` members of `.npz` files, as NumPy writes them.

The header is compared with the one form that NumPy writes, and the size that it declares with the bytes that are there.
"""

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthtrack.errors import DamagedFrameError
from depthtrack.recording.zip_members import ZipMembers

MAX_ARRAY_BYTES = 1 << 28
"""Bytes of the largest array read."""
_MAGIC = b"\x93NUMPY"
_LENGTH_BYTES = {b"\x01\x00": 2, b"\x02\x00": 4}
"""Bytes of a header's length, by version of the format."""
_LONGEST_HEADER = 10_000
_HEADER = re.compile(
    rb"\{'descr': '([<>|][biuf][1248]|[<>]U[1-9][0-9]{0,4})', 'fortran_order': (True|False), "
    rb"'shape': \(((?:[0-9]{1,15}, ?){0,7}(?:[0-9]{1,15})?)\),? ?\} *\n"
)


def read_arrays(path: Path, names: tuple[str, ...], largest: int = MAX_ARRAY_BYTES) -> dict[str, NDArray[Any]]:
    """Return those of the named arrays that an `.npz` file has: numbers, truth values or text.

    largest: bytes of an array at most.

    Raises:
        InputError: if the file is damaged, or an array is of another type or too large.
    """
    members = ZipMembers.of(path)
    present = [name for name in names if f"{name}.npy" in members.members]
    return {
        name: _parse(members.read(f"{name}.npy", largest + _LONGEST_HEADER), f"{path}: {name}.npy") for name in present
    }


def _parse(data: bytes, where: str) -> NDArray[Any]:
    """Return the array of the bytes of a member."""
    version = data[6:8]
    if data[:6] != _MAGIC or version not in _LENGTH_BYTES:
        raise DamagedFrameError(f"{where} must be of NumPy's array format 1.0 or 2.0, found {data[:8]!r}")
    begin = 8 + _LENGTH_BYTES[version]
    length = int.from_bytes(data[8:begin], "little")
    header = data[begin : begin + min(length, _LONGEST_HEADER)]
    found = _HEADER.fullmatch(header)
    if found is None:
        raise DamagedFrameError(
            f"{where} must hold numbers or names, with a header as NumPy writes it, found {header[:100]!r}"
        )
    try:
        dtype = np.dtype(found[1].decode())
    except TypeError as error:
        raise DamagedFrameError(f"{where} must hold numbers or names, found {found[1]!r}") from error
    shape = tuple(int(extent) for extent in found[3].replace(b" ", b"").split(b",") if extent)
    claimed, available = math.prod(shape) * dtype.itemsize, len(data) - begin - length
    if claimed > available:
        raise DamagedFrameError(f"{where} must have at most {available:,} bytes, found {claimed:,} in its header")
    values = np.frombuffer(data, dtype, math.prod(shape), begin + length)
    if dtype.kind == "U":
        _check_text(values, where)
    return values.reshape(shape, order="F" if found[2] == b"True" else "C")


def _check_text(values: NDArray[Any], where: str) -> None:
    codes = values.view(np.dtype(np.uint32).newbyteorder(values.dtype.byteorder))
    if np.any((codes > 0x10FFFF) | ((codes >= 0xD800) & (codes < 0xE000))):
        raise DamagedFrameError(f"{where} must hold names of Unicode characters")
