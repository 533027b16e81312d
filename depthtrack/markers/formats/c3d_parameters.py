"""The parameter section of a C3D file: groups of named arrays in a chain of records.

Source: The C3D File Format User Guide, c3d.org, "The Parameter Section".
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from depthtrack.errors import InputError
from depthtrack.markers.formats.text_rows import decoded
from depthtrack.types import Array

BLOCK = 512
"""Bytes of a block; addresses in the file count blocks from 1."""
Processor = Literal["intel", "dec", "mips"]
_PROCESSORS: dict[int, Processor] = {84: "intel", 85: "dec", 86: "mips"}
_SIZES = {-1: 1, 1: 1, 2: 2, 4: 4}
"""Bytes of an element by the type of a parameter: character, byte, integer, float."""
_MOST_DIMENSIONS = 7
_MOST_RECORDS = 10_000
_GROUPS = ("POINT", "ANALOG", "TRIAL")


@dataclass(frozen=True)
class Parameter:
    """An array of a group.

    kind: -1 characters, 1 bytes, 2 integers, 4 floats.
    shape: its dimensions, the first one fastest; empty for a single value.
    """

    kind: int
    shape: tuple[int, ...]
    data: bytes
    processor: Processor

    def numbers(self) -> Array:
        """Return the values as numbers; 16-bit integers without sign. Characters are none."""
        match self.kind:
            case 4:
                return floats(self.data, self.processor)
            case 2:
                return np.frombuffer(self.data, dtype=word_type(self.processor)).astype(np.float64)
            case 1:
                return np.frombuffer(self.data, dtype=np.uint8).astype(np.float64)
        return np.zeros(0)

    def strings(self) -> tuple[str, ...]:
        """Return rows of characters without the blanks around them; numbers are none."""
        if self.kind != -1 or not self.data:
            return ()
        length = self.shape[0] if self.shape else 1
        rows = (self.data[start : start + length] for start in range(0, len(self.data), length))
        return tuple(decoded(row.partition(b"\0")[0]).strip() for row in rows)


@dataclass(frozen=True)
class Parameters:
    """The parameters of a file by their group's and their own name, in upper case."""

    processor: Processor
    entries: dict[tuple[str, str], Parameter]

    def numbers(self, group: str, name: str) -> Array:
        """Return the numbers of a parameter; none if it is missing."""
        entry = self.entries.get((group, name))
        return np.zeros(0) if entry is None else entry.numbers()

    def number(self, group: str, name: str) -> float | None:
        """Return the first number of a parameter; None if it is missing, empty or not finite."""
        values = self.numbers(group, name)
        return float(values[0]) if len(values) and np.isfinite(values[0]) else None

    def strings(self, group: str, name: str) -> tuple[str, ...]:
        """Return the strings of a parameter and its continuations `name2`, `name3` and so on."""
        found: list[str] = []
        suffix, number = "", 1
        while entry := self.entries.get((group, name + suffix)):
            found += entry.strings()
            number += 1
            suffix = str(number)
        return tuple(found)


def read_parameters(section: bytes, start: int, where: str) -> Parameters:
    """Read the parameters of the groups POINT, ANALOG and TRIAL.

    section: bytes of the section; it may be longer.
    start: its place in the file, for errors.

    Raises:
        InputError: if a record leaves the section or overlaps the next one; the message states the byte.
    """
    if len(section) < 4 or section[3] not in _PROCESSORS:
        found = section[3] if len(section) > 3 else "the end of the file"
        raise InputError(f"{where}, byte {start + 3}: expected the processor 84, 85 or 86, found {found}")
    processor = _PROCESSORS[section[3]]
    records = list(_records(section, processor, start, where))
    groups = {-record.group: record.name for record in records if record.group < 0}
    entries = {}
    for record in records:
        group = groups.get(record.group, "")
        if group in _GROUPS:
            entries[group, record.name] = _parameter(section, record, processor, start, where)
    return Parameters(processor, entries)


def floats(data: bytes, processor: Processor) -> Array:
    """Return 4-byte floats; those of DEC have exchanged halves and four times the value."""
    # A damaged value may be a signalling NaN, which numpy warns of.
    with np.errstate(invalid="ignore"):
        if processor == "dec":
            halves = np.frombuffer(data, dtype="<u2").reshape(-1, 2)[:, ::-1]
            return np.ascontiguousarray(halves).view("<f4")[:, 0].astype(np.float64) / 4
        return np.frombuffer(data, dtype=">f4" if processor == "mips" else "<f4").astype(np.float64)


def word_type(processor: Processor) -> str:
    """Return the numpy type of a 16-bit word without sign."""
    return ">u2" if processor == "mips" else "<u2"


@dataclass(frozen=True)
class _Record:
    """A group if its number is below 0, else a parameter of it; contents section[body:end]."""

    name: str
    group: int
    body: int
    end: int


def _records(section: bytes, processor: Processor, start: int, where: str) -> Iterator[_Record]:
    order: Literal["big", "little"] = "big" if processor == "mips" else "little"
    # The first byte is the place of the first record, from 1; some programs write 0.
    place = 4 + max(section[0], 1) - 1
    for _ in range(_MOST_RECORDS):
        length, group = _signed(section[place : place + 1]), _signed(section[place + 1 : place + 2])
        offset_place = place + 2 + abs(length)
        if length == 0:
            return
        if offset_place + 2 > len(section):
            raise InputError(f"{where}, byte {start + place}: a parameter's name leaves the section of parameters")
        offset = int.from_bytes(section[offset_place : offset_place + 2], order)
        end = offset_place + offset if offset else len(section)
        if end > len(section) or 0 < offset < 3:
            raise InputError(f"{where}, byte {start + offset_place}: a parameter leaves the section of parameters")
        name = decoded(section[place + 2 : offset_place]).strip().upper()
        yield _Record(name, group, offset_place + 2, end)
        if not offset:
            return
        place = end
    raise InputError(f"{where}, byte {start + place}: expected at most {_MOST_RECORDS:,} parameters")


def _parameter(section: bytes, record: _Record, processor: Processor, start: int, where: str) -> Parameter:
    body = section[record.body : record.end]
    kind = _signed(body[:1])
    dimensions = body[1] if len(body) > 1 else _MOST_DIMENSIONS + 1
    if kind not in _SIZES or dimensions > _MOST_DIMENSIONS:
        place = start + record.body
        raise InputError(f"{where}, byte {place}: the parameter {record.name[:20]!r} has no valid type and dimensions")
    shape = tuple(body[2 : 2 + dimensions])
    first, size = 2 + dimensions, _SIZES[kind] * math.prod(shape)
    if first + size > len(body):
        found = f"{size:,} bytes, its record {max(len(body) - first, 0):,}"
        raise InputError(f"{where}, byte {start + record.body}: the values of {record.name[:20]!r} need {found}")
    return Parameter(kind, shape, body[first : first + size], processor)


def _signed(byte: bytes) -> int:
    return int.from_bytes(byte, "little", signed=True)
