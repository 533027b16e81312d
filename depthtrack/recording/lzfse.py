"""Decompression of LZFSE data of a known size.

The sizes that its blocks declare are added up before anything is decompressed.

| mark | block                      | header                                                                  |
|------|----------------------------|-------------------------------------------------------------------------|
| bvx- | raw bytes                  | size                                                                    |
| bvxn | LZVN                       | size, compressed size                                                   |
| bvx1 | LZFSE, plain tables        | size, compressed size, literals, matches, ...                           |
| bvx2 | LZFSE, compressed tables   | size, then three packed 64-bit fields                                   |
| bvx$ | end                        |                                                                         |

Source: E. Bainville et al., the LZFSE reference implementation, lzfse_internal.h.
"""

import struct
from dataclasses import dataclass

from depthtrack.errors import InputError, MissingExtraError

_V1_HEADER_BYTES = 772
_SHORTEST_MATCH = 3
_SPARE_MATCHES = 16
"""Entries of a block beyond one for each shortest match: literals without a match."""


@dataclass(frozen=True)
class _Block:
    """Bytes that a block takes, bytes and matches that it declares."""

    length: int
    size: int
    matches: int


def decompress(data: bytes, size: int) -> bytes:
    """Return the `size` bytes of LZFSE data.

    Raises:
        InputError: if the data is damaged, or declares another size.
        MissingExtraError: if the library `lzfse` is not installed.
    """
    try:
        import lzfse
    except ImportError as error:
        raise MissingExtraError("Record3D's depth", "record3d") from error
    declared = _declared_size(data)
    if declared != size:
        raise InputError(f"LZFSE data must hold {size:,} bytes, found {declared:,} declared")
    try:
        found = lzfse.decompress(data)
    except (lzfse.error, MemoryError) as error:
        raise InputError("LZFSE data is damaged") from error
    if len(found) != size:
        raise InputError(f"LZFSE data must hold {size:,} bytes, found {len(found):,}")
    return bytes(found)


def _declared_size(data: bytes) -> int:
    """Return the sum of the sizes that the blocks declare.

    Raises:
        InputError: if a block is cut or unknown, or has more matches than its size allows.
    """
    offset = total = 0
    while data[offset : offset + 4] != b"bvx$":
        try:
            block = _block(data, offset)
        except struct.error as error:
            raise InputError("LZFSE data is cut") from error
        if offset + block.length > len(data):
            raise InputError("LZFSE data is cut")
        # A match may repeat 2,359 bytes, so matches are bounded too: the declared size alone binds no decoder.
        if block.matches > block.size // _SHORTEST_MATCH + _SPARE_MATCHES:
            raise InputError("LZFSE data has more matches than its size allows")
        offset, total = offset + block.length, total + block.size
    return total


def _block(data: bytes, offset: int) -> _Block:
    mark = data[offset : offset + 4]
    (size,) = struct.unpack_from("<I", data, offset + 4)
    if mark == b"bvx-":
        return _Block(8 + size, size, 0)
    if mark == b"bvxn":
        (payload,) = struct.unpack_from("<I", data, offset + 8)
        return _Block(12 + payload, size, 0)
    if mark == b"bvx1":
        payload, _, matches = struct.unpack_from("<3I", data, offset + 8)
        return _Block(_V1_HEADER_BYTES + payload, size, matches)
    if mark == b"bvx2":
        first, second, third = struct.unpack_from("<3Q", data, offset + 8)
        literal_bytes, match_bytes = first >> 20 & 0xFFFFF, second >> 40 & 0xFFFFF
        return _Block((third & 0xFFFFFFFF) + literal_bytes + match_bytes, size, first >> 40 & 0xFFFFF)
    raise InputError(f"LZFSE data must consist of blocks marked bvx, found {mark!r}")
