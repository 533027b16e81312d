"""Members of a zip file, read one at a time with bounds on their sizes.

The list of members is at the end of a zip file. If the file is truncated, the headers before the members are read.
Source: PKWARE, APPNOTE.TXT, sections 4.3 and 4.5.
"""

import re
import struct
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Self

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.files import open_regular

_HEADER = struct.Struct("<4s5H3I2H")
_DESCRIPTOR = struct.Struct("<4s3I")
_HEADER_MARK, _DESCRIPTOR_MARK = b"PK\3\4", b"PK\7\10"
_SIZES_FOLLOW, _ENCRYPTED = 8, 1
_STORED, _DEFLATED = 0, 8
_IN_EXTRA = 0xFFFFFFFF
_MAX_MEMBERS = 4_000_000
_MAX_UNSIZED = 1 << 26
"""Largest member, bytes, whose end is searched because its header states no size."""


@dataclass(frozen=True, slots=True)
class _Member:
    """Offset of the header, method, checksum, sizes in bytes."""

    offset: int
    method: int
    crc: int
    compressed: int
    size: int


@dataclass(frozen=True)
class ZipMembers:
    """The members of a zip file by name.

    truncated: the list at the end of the file is missing, so only the members before the cut are known.
    """

    path: Path
    members: dict[str, _Member]
    truncated: bool

    @classmethod
    def of(cls, path: Path) -> Self:
        """Return the members of a zip file.

        Raises:
            InputError: if it cannot be read, has no complete member, or too many.
        """
        try:
            members, truncated = _listed(path), False
        except (zipfile.BadZipFile, NotImplementedError, ValueError, struct.error):
            members, truncated = _scanned(path), True
        except OSError as error:
            raise InputError(f"cannot read {path}: {error.strerror}") from error
        if not 1 <= len(members) <= _MAX_MEMBERS:
            raise InputError(f"{path} must be a zip file of 1 to {_MAX_MEMBERS:,} members, found {len(members):,}")
        return cls(path, members, truncated)

    def numbered(self, pattern: re.Pattern[str]) -> dict[int, str]:
        """Return the names that match as a whole, by the number in the only group, increasing."""
        return dict(sorted((int(match[1]), name) for name in self.members if (match := pattern.fullmatch(name))))

    def read(self, name: str, largest: int) -> bytes:
        """Return the bytes of a member.

        Raises:
            DamagedFrameError: if it is missing, damaged or encrypted, or longer than `largest` bytes.
        """
        where, member = f"{self.path}: {name}", self.members.get(name)
        if member is None:
            raise DamagedFrameError(f"{where} is missing")
        if member.size > largest or member.compressed > largest + 1024:
            raise DamagedFrameError(f"{where} must be at most {largest:,} bytes long, found {member.size:,}")
        if member.method not in (_STORED, _DEFLATED):
            raise DamagedFrameError(f"{where} must be stored or deflated, found method {member.method}")
        try:
            with open_regular(self.path) as file:
                data = _content(file, member)
        except (OSError, struct.error, zlib.error, ValueError) as error:
            raise DamagedFrameError(f"{where} is damaged: {error}") from error
        if len(data) != member.size or zlib.crc32(data) != member.crc:
            raise DamagedFrameError(f"{where} is damaged: its checksum or its size is wrong")
        return data


def _listed(path: Path) -> dict[str, _Member]:
    """Return the members in the list at the end of the file."""
    with open_regular(path) as file, zipfile.ZipFile(file) as archive:
        return {
            info.filename: _Member(info.header_offset, info.compress_type, info.CRC, info.compress_size, info.file_size)
            for info in archive.infolist()
        }


def _scanned(path: Path) -> dict[str, _Member]:
    """Return the complete members in front of the cut."""
    found: dict[str, _Member] = {}
    end = path.stat().st_size
    with open_regular(path) as file:
        offset = 0
        while len(found) <= _MAX_MEMBERS and (read := _header(file, offset)) is not None:
            name, begin, member = read
            if begin + member.compressed > end:
                break
            found[name] = member
            offset = begin + member.compressed
            file.seek(offset)
            if file.read(4) == _DESCRIPTOR_MARK:
                offset += _DESCRIPTOR.size
    return found


def _header(file: BinaryIO, offset: int) -> tuple[str, int, _Member] | None:
    """Return the name, the offset of the bytes, and the member at `offset`, or None."""
    file.seek(offset)
    data = file.read(_HEADER.size)
    if len(data) < _HEADER.size or not data.startswith(_HEADER_MARK):
        return None
    _, _, flags, method, _, _, crc, compressed, size, name_bytes, extra_bytes = _HEADER.unpack(data)
    name = file.read(name_bytes).decode("utf-8", errors="replace")
    extra = file.read(extra_bytes)
    begin = offset + _HEADER.size + name_bytes + extra_bytes
    if _IN_EXTRA in (compressed, size):
        size, compressed = _long_sizes(extra)
    if flags & _SIZES_FOLLOW and not compressed:
        described = _descriptor(file, begin)
        if described is None:
            return None
        crc, compressed, size = described
    return name, begin, _Member(offset, method, crc, compressed, size)


def _long_sizes(extra: bytes) -> tuple[int, int]:
    """Return the size and the compressed size in a ZIP64 extra field.

    Without one they are larger than any file.
    """
    while len(extra) >= 4:
        kind, length = struct.unpack_from("<2H", extra)
        if kind == 1 and length >= 16 and len(extra) >= 20:
            size, compressed = struct.unpack_from("<2Q", extra, 4)
            return int(size), int(compressed)
        extra = extra[4 + length :]
    return 1 << 63, 1 << 63


def _descriptor(file: BinaryIO, begin: int) -> tuple[int, int, int] | None:
    """Return checksum, compressed size and size stated behind bytes, or None if they are cut.

    begin: offset of the bytes.
    """
    file.seek(begin)
    data = file.read(_MAX_UNSIZED + _DESCRIPTOR.size)
    place = data.find(_DESCRIPTOR_MARK)
    while 0 <= place <= len(data) - _DESCRIPTOR.size:
        _, crc, compressed, size = _DESCRIPTOR.unpack_from(data, place)
        if compressed == place:
            return crc, compressed, size
        place = data.find(_DESCRIPTOR_MARK, place + 1)
    return None


def _content(file: BinaryIO, member: _Member) -> bytes:
    """Return the decompressed bytes of a member, at most one more than its stated size."""
    file.seek(member.offset)
    mark, _, flags, *_, name_bytes, extra_bytes = _HEADER.unpack(file.read(_HEADER.size))
    if mark != _HEADER_MARK or flags & _ENCRYPTED:
        raise ValueError("its header is missing or it is encrypted")
    file.seek(name_bytes + extra_bytes, 1)
    data = file.read(member.compressed)
    if member.method == _DEFLATED:
        data = zlib.decompressobj(-zlib.MAX_WBITS).decompress(data, member.size + 1)
    return data
