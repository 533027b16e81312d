"""Bags of ROS 1, version 2.0, read without their index: a cut file is read up to the cut.

Source: ROS wiki, "Bags/Format/2.0".
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.recording.bags.chunks import Chunk, ChunkedFile
from depthtrack.recording.bags.storage import TOP, ConnectionIndex, Serialisation, Topic
from depthtrack.types import Index

MAGIC = b"#ROSBAG V2.0\n"
_MESSAGE, _BAG, _INDEX, _CHUNK, _CONNECTION = 2, 3, 4, 5, 7
_LENGTH = struct.Struct("<I")
_LARGEST_HEADER = 1 << 20


@dataclass(frozen=True)
class _Record:
    """Header fields of a record, its start, and the place of its data."""

    fields: dict[str, bytes]
    start: int
    position: int
    length: int

    @property
    def op(self) -> int:
        return self.fields.get("op", b"\0")[0]

    def number(self, name: str) -> int:
        return int.from_bytes(self.fields.get(name, b"")[:8], "little")

    @property
    def time(self) -> int:
        """Nanoseconds."""
        seconds, nanoseconds = struct.unpack("<II", self.fields.get("time", b"").ljust(8, b"\0")[:8])
        return int(seconds) * 10**9 + int(nanoseconds)


class Ros1Storage:
    """A ROS 1 bag; see `Storage`."""

    serialisation: Serialisation = "ros1"

    def __init__(self, path: Path) -> None:
        """Index the file.

        Raises:
            InputError: if it is no bag of version 2.0.
        """
        self.path = path
        self.cut: str | None = None
        self._source = ChunkedFile(path)
        self._index = ConnectionIndex()
        if self._source.bytes_at(0, min(len(MAGIC), self._source.size)) != MAGIC:
            raise InputError(f"{path} must begin as a ROS 1 bag of version 2.0 does")
        self._scan()
        self._find_connections()
        self.topics = self._index.topics

    def times(self, topic: str) -> Index:
        """See `Storage`."""
        return self._index.rows(topic)[:, 0]

    def read(self, topic: str, index: int, most: int | None = None) -> bytes:
        """See `Storage`."""
        _, chunk, offset = (int(value) for value in self._index.rows(topic)[index])
        if chunk == TOP:
            record = self._record(offset)
            return self._source.bytes_at(record.position, min(record.length, most or record.length))
        data = self._source.chunk(chunk)
        inner = _inner_record(data, offset)
        # The index of some writers leads to the connection before the message.
        while inner is not None and inner.op == _CONNECTION:
            inner = _inner_record(data, inner.position + inner.length)
        if inner is None or inner.op != _MESSAGE:
            raise DamagedFrameError(f"{self.path}: the index of a chunk leads to no message")
        return data[inner.position : inner.position + min(inner.length, most or inner.length)]

    def close(self) -> None:
        """Close the file."""
        self._source.close()

    def _record(self, position: int) -> _Record:
        """Return the record at a place. Raises DamagedFrameError if the file ends within it."""
        (length,) = _LENGTH.unpack(self._source.bytes_at(position, 4))
        if length > _LARGEST_HEADER:
            raise DamagedFrameError(f"{self.path}: a record header must be at most {_LARGEST_HEADER:,} bytes")
        fields = _fields(self._source.bytes_at(position + 4, length))
        (count,) = _LENGTH.unpack(self._source.bytes_at(position + 4 + length, 4))
        return _Record(fields, position, position + 8 + length, count)

    def _scan(self) -> None:
        """Index the records of the file up to its end, or to the first one that is incomplete."""
        position, open_chunk, complete = len(MAGIC), False, False
        while position < self._source.size:
            try:
                record = self._record(position)
            except DamagedFrameError:
                break
            end = record.position + record.length
            if end > self._source.size:
                break
            if open_chunk and record.op != _INDEX:
                self._index_chunk(len(self._source.chunks) - 1)
            open_chunk = False
            if record.op == _BAG:
                complete = record.number("index_pos") > 0
            elif record.op == _CHUNK:
                if record.length:
                    compression = record.fields.get("compression", b"none").decode("ascii", errors="replace")
                    size = record.number("size")
                    self._source.chunks.append(Chunk(record.position, record.length, compression, size))
                    open_chunk = True
            elif record.op == _INDEX:
                self._add_index(record)
            elif record.op == _CONNECTION:
                self._define(record, self._source.bytes_at(record.position, min(record.length, 1 << 24)))
            elif record.op == _MESSAGE:
                self._index.add(record.number("conn"), record.time, TOP, position)
            position = end
        if open_chunk:
            self._index_chunk(len(self._source.chunks) - 1)
        if position < self._source.size or not complete:
            self.cut = f"the file ends at byte {self._source.size:,} without its index"

    def _add_index(self, record: _Record) -> None:
        data = self._source.bytes_at(record.position, record.length)
        connection, chunk = record.number("conn"), len(self._source.chunks) - 1
        for seconds, nanoseconds, offset in struct.iter_unpack("<III", data[: len(data) // 12 * 12]):
            self._index.add(connection, seconds * 10**9 + nanoseconds, chunk, offset)

    def _index_chunk(self, number: int) -> None:
        """Index a chunk that no index records follow; a damaged one is left out."""
        try:
            data = self._source.chunk(number)
        except DamagedFrameError:
            return
        for record in _records(data):
            if record.op == _MESSAGE:
                self._index.add(record.number("conn"), record.time, number, record.start)

    def _find_connections(self) -> None:
        """Read the connections that only chunks define: those of a file without its index."""
        for connection, last in list(self._index.undefined()):
            for number in range(last + 1):
                if self._index.is_defined(connection):
                    break
                try:
                    data = self._source.chunk(number)
                except DamagedFrameError:
                    continue
                for record in _records(data):
                    if record.op == _CONNECTION:
                        self._define(record, data[record.position : record.position + record.length])

    def _define(self, record: _Record, data: bytes) -> None:
        described = _fields(data)
        name = record.fields.get("topic", b"").decode("utf-8", errors="replace")
        kind = described.get("type", b"").decode("utf-8", errors="replace")
        package, _, message = kind.partition("/")
        definition = described.get("message_definition", b"").decode("utf-8", errors="replace")
        self._index.define(record.number("conn"), Topic(name, f"{package}/msg/{message}", definition))


def _inner_record(data: bytes, position: int) -> _Record | None:
    """Return the record at a place of a chunk; None if the chunk ends before it does."""
    if position < 0 or position + 4 > len(data):
        return None
    (length,) = _LENGTH.unpack_from(data, position)
    after = position + 4 + length
    if after + 4 > len(data):
        return None
    (count,) = _LENGTH.unpack_from(data, after)
    if after + 4 + count > len(data):
        return None
    return _Record(_fields(data[position + 4 : after]), position, after + 4, count)


def _records(data: bytes) -> Iterator[_Record]:
    """Yield the complete records of a chunk."""
    position = 0
    while (record := _inner_record(data, position)) is not None:
        yield record
        position = record.position + record.length


def _fields(header: bytes) -> dict[str, bytes]:
    """Return the fields `name=value` of a header, up to the first malformed one."""
    found, position = {}, 0
    while position + 4 <= len(header):
        (length,) = _LENGTH.unpack_from(header, position)
        field = header[position + 4 : position + 4 + length]
        name, equals, value = field.partition(b"=")
        if not equals or len(field) != length:
            break
        found[name.decode("ascii", errors="replace")] = value
        position += 4 + length
    return found
