"""The compression 16z of OpenNI: differences of neighbouring depth values in half bytes.

The first value is stored as it is. Then a byte is one of

| byte                   | meaning                                                                             |
|------------------------|-------------------------------------------------------------------------------------|
| 0xFF                   | an escape follows                                                                   |
| 0xE0 to 0xFE           | the last value, twice as often as the low half states                               |
| ab, a < 0xE            | the value falls by a - 6, then by b - 6; b = 0xD: nothing; b = 0xF: an escape follows |

An escape is a byte c from 0x80, by which the value falls by c - 192, or the value itself, high byte first. With an
embedded table, values are rows of a table of the values that occur.
Source: PrimeSense, OpenNI 2, Formats/XnStreamCompression.cpp.
"""

import numpy as np
from numpy.typing import NDArray

from depthtrack.types import Index

_RUN, _ESCAPE, _NOTHING, _THEN_ESCAPE = 0xE0, 0xFF, 0xD, 0xF
_ZERO, _ZERO_ESCAPED = 6, 192


def decompress_with_table(data: bytes, count: int) -> NDArray[np.uint16]:
    """Return `count` values of data that begins with a table.

    Raises:
        ValueError: if it is damaged or holds another number of values.
    """
    words = np.frombuffer(data, "<u2", len(data) // 2)
    size = int(words[0]) if len(words) else 0
    table = words[1 : 1 + size]
    rows = decompress(data[2 + 2 * size :], count)
    if rows.max(initial=0) >= len(table):
        raise ValueError("a value is outside its table")
    return table[rows].astype(np.uint16)


def decompress(data: bytes, count: int) -> NDArray[np.uint16]:
    """Return `count` values.

    Raises:
        ValueError: if the data is damaged or holds another number of values.
    """
    if len(data) < 2:
        raise ValueError("its first value is missing")
    stream = np.frombuffer(data, np.uint8, offset=2).astype(np.int64)
    low = stream & 0xF
    escapes = _escapes(data[2:], np.flatnonzero((stream == _ESCAPE) | ((stream < _RUN) & (low == _THEN_ESCAPE))))
    is_code = np.ones(len(stream), dtype=np.bool_)
    long = escapes[np.take(stream, escapes + 1) < 0x80]
    is_code[escapes + 1] = False
    is_code[long + 2] = False

    counts = np.where(stream < _RUN, np.where(low == _NOTHING, 1, 2), 2 * (stream - _RUN))
    counts = np.where(stream == _ESCAPE, 1, counts) * is_code
    if 1 + counts.sum() != count:
        raise ValueError(f"it must hold {count:,} values, found {1 + counts.sum():,}")
    place = 1 + np.cumsum(counts) - counts  # of the first value of each code

    falls: Index = np.zeros(count, dtype=np.int64)
    pairs = np.flatnonzero(is_code & (stream < _RUN))
    falls[place[pairs]] = (stream[pairs] >> 4) - _ZERO
    second = pairs[(low[pairs] != _NOTHING) & (low[pairs] != _THEN_ESCAPE)]
    falls[place[second] + 1] = low[second] - _ZERO
    escaped = place[escapes] + (stream[escapes] != _ESCAPE)
    short = np.take(stream, escapes + 1) >= 0x80
    falls[escaped[short]] = stream[escapes[short] + 1] - _ZERO_ESCAPED

    stated: Index = np.zeros(count, dtype=np.int64)
    is_stated = np.zeros(count, dtype=np.bool_)
    stated[0], is_stated[0] = int.from_bytes(data[:2], "little"), True
    stated[escaped[~short]] = 256 * stream[long + 1] + stream[long + 2]
    is_stated[escaped[~short]] = True
    last = np.maximum.accumulate(np.where(is_stated, np.arange(count), 0))
    fallen = np.cumsum(falls)
    return (stated[last] - (fallen - fallen[last]) & 0xFFFF).astype(np.uint16)


def _escapes(stream: bytes, candidates: Index) -> Index:
    """Return the candidates that are codes, and not the bytes of an earlier escape.

    Raises:
        ValueError: if the bytes of the last escape are missing.
    """
    found, end = list[int](), 0
    for place in candidates.tolist():
        if place >= end:
            found.append(place)
            if place + 1 >= len(stream):
                raise ValueError("its end is missing")
            end = place + (2 if stream[place + 1] & 0x80 else 3)
    if end > len(stream):
        raise ValueError("its end is missing")
    return np.array(found, dtype=np.int64)
