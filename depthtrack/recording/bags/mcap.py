"""MCAP files, read without their summary: a file that is cut short is read up to the cut.

Source: the MCAP format specification (mcap.dev/spec), version 0.
"""

import struct
from pathlib import Path

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.recording.bags.chunks import Chunk, ChunkedFile
from depthtrack.recording.bags.storage import TOP, ConnectionIndex, Serialisation, Topic
from depthtrack.types import Index

MAGIC = b"\x89MCAP0\r\n"
_FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _MESSAGE_INDEX = 0x02, 0x03, 0x04, 0x05, 0x06, 0x07
_RECORD = struct.Struct("<BQ")
_MESSAGE_HEADER = struct.Struct("<HIQQ")
_CHUNK_HEADER = struct.Struct("<QQQI")


class McapStorage:
    """An MCAP file with ROS 2 messages; see `Storage`."""

    serialisation: Serialisation = "cdr"

    def __init__(self, path: Path) -> None:
        """Index the file.

        Raises:
            InputError: if it is no MCAP file.
        """
        self.path = path
        self.cut: str | None = None
        self._source = ChunkedFile(path)
        self._index = ConnectionIndex()
        self._schemas: dict[int, str] = {}
        if self._source.bytes_at(0, min(len(MAGIC), self._source.size)) != MAGIC:
            raise InputError(f"{path} must begin as an MCAP file does")
        self._scan()
        self._find_channels()
        self.topics = self._index.topics

    def times(self, topic: str) -> Index:
        """See `Storage`."""
        return self._index.rows(topic)[:, 0]

    def read(self, topic: str, index: int, most: int | None = None) -> bytes:
        """See `Storage`."""
        _, chunk, offset = (int(value) for value in self._index.rows(topic)[index])
        start = _RECORD.size + _MESSAGE_HEADER.size
        if chunk == TOP:
            _, length = _RECORD.unpack(self._source.bytes_at(offset, _RECORD.size))
            count = length - _MESSAGE_HEADER.size
            return self._source.bytes_at(offset + start, count if most is None else min(count, most))
        data = self._source.chunk(chunk)
        op, length = _unpacked(_RECORD, data, offset, self.path)
        end = offset + _RECORD.size + length
        if op != _MESSAGE or end > len(data):
            raise DamagedFrameError(f"{self.path}: the index of a chunk leads to no message")
        return data[offset + start : end if most is None else min(end, offset + start + most)]

    def close(self) -> None:
        """Close the file."""
        self._source.close()

    def _scan(self) -> None:
        """Index the records of the file up to its footer, or its end."""
        position, unindexed = len(MAGIC), False
        while position + _RECORD.size <= self._source.size:
            op, length = _RECORD.unpack(self._source.bytes_at(position, _RECORD.size))
            body, end = position + _RECORD.size, position + _RECORD.size + length
            if end > self._source.size:
                break
            if unindexed and op != _MESSAGE_INDEX:
                self._index_chunk(len(self._source.chunks) - 1)
            unindexed = False
            if op == _FOOTER:
                return
            if op == _CHUNK:
                self._add_chunk(body, length)
                unindexed = True
            elif op == _MESSAGE_INDEX:
                self._add_index(self._source.bytes_at(body, length))
            elif op == _MESSAGE:
                header = self._source.bytes_at(body, _MESSAGE_HEADER.size)
                channel, _, time, _ = _MESSAGE_HEADER.unpack(header)
                self._index.add(channel, time, TOP, position)
            elif op in (_SCHEMA, _CHANNEL):
                self._define(op, self._source.bytes_at(body, length))
            position = end
        if unindexed:
            self._index_chunk(len(self._source.chunks) - 1)
        self.cut = f"the file ends at byte {self._source.size:,} without a footer"

    def _add_chunk(self, body: int, length: int) -> None:
        head = self._source.bytes_at(body, min(length, _CHUNK_HEADER.size + 4 + 64 + 8))
        _, _, size, _ = _unpacked(_CHUNK_HEADER, head, 0, self.path)
        compression, after = _string(head, _CHUNK_HEADER.size, self.path)
        (count,) = _unpacked(struct.Struct("<Q"), head, after, self.path)
        if after + 8 + count > length:
            raise InputError(f"{self.path}: a chunk states more data than its record has")
        self._source.chunks.append(Chunk(body + after + 8, count, compression, size))

    def _add_index(self, data: bytes) -> None:
        channel, count = _unpacked(struct.Struct("<HI"), data, 0, self.path)
        entries = data[6 : 6 + count]
        for time, offset in struct.iter_unpack("<QQ", entries[: len(entries) // 16 * 16]):
            self._index.add(channel, min(time, 2**63 - 1), len(self._source.chunks) - 1, min(offset, 2**63 - 1))

    def _index_chunk(self, number: int) -> None:
        """Index a chunk that no index records follow; a damaged one is left out."""
        try:
            data = self._source.chunk(number)
        except DamagedFrameError:
            return
        for op, position, length in _records(data):
            if op == _MESSAGE and length >= _MESSAGE_HEADER.size:
                channel, _, time, _ = _MESSAGE_HEADER.unpack_from(data, position + _RECORD.size)
                self._index.add(channel, time, number, position)

    def _find_channels(self) -> None:
        """Read the channels that only chunks define: those of a file without a summary."""
        for channel, last in list(self._index.undefined()):
            for number in range(last + 1):
                if self._index.is_defined(channel):
                    break
                try:
                    data = self._source.chunk(number)
                except DamagedFrameError:
                    continue
                for op, position, length in _records(data):
                    if op in (_SCHEMA, _CHANNEL):
                        body = position + _RECORD.size
                        self._define(op, data[body : body + length])

    def _define(self, op: int, data: bytes) -> None:
        """Add a schema or a channel. Channels of other encodings than CDR are left out."""
        number = int.from_bytes(data[:2], "little")
        if op == _SCHEMA:
            self._schemas[number], _ = _string(data, 2, self.path)
            return
        schema = int.from_bytes(data[2:4], "little")
        topic, after = _string(data, 4, self.path)
        encoding, _ = _string(data, after, self.path)
        if encoding == "cdr":
            self._index.define(number, Topic(topic, self._schemas.get(schema, "")))


def _records(data: bytes) -> list[tuple[int, int, int]]:
    """Return op, place and length of each complete record in a chunk."""
    found, position = [], 0
    while position + _RECORD.size <= len(data):
        op, length = _RECORD.unpack_from(data, position)
        if position + _RECORD.size + length > len(data):
            break
        found.append((op, position, length))
        position += _RECORD.size + length
    return found


def _unpacked(layout: struct.Struct, data: bytes, offset: int, path: Path) -> tuple[int, ...]:
    if offset < 0 or offset + layout.size > len(data):
        raise DamagedFrameError(f"{path}: a record is too short")
    return layout.unpack_from(data, offset)


def _string(data: bytes, offset: int, path: Path) -> tuple[str, int]:
    """Return the text at an offset, and the offset after it."""
    (length,) = _unpacked(struct.Struct("<I"), data, offset, path)
    end = offset + 4 + length
    if end > len(data):
        raise DamagedFrameError(f"{path}: a record is too short")
    return data[offset + 4 : end].decode("utf-8", errors="replace"), end
