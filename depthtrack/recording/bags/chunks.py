"""Files whose messages lie in compressed chunks, decompressed within bounds."""

import bz2
import sys
import threading
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

from depthtrack.errors import DamagedFrameError, InputError, MissingExtraError
from depthtrack.files import open_regular

LARGEST_CHUNK = 1 << 29
"""Bound on the declared size of a chunk, compressed or not, and of a message, bytes."""
_CACHED_CHUNKS = 3


@dataclass(frozen=True)
class Chunk:
    """Place of a chunk's compressed data in the file, and its size after decompression."""

    position: int
    length: int
    compression: str
    size: int


class ChunkedFile:
    """A file whose chunks are decompressed when needed; the last few are kept.

    Any thread may read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self.file: BinaryIO = open_regular(path)
        except OSError as error:
            raise InputError(f"cannot read {path}: {error.strerror}") from error
        self.size = path.stat().st_size
        self.chunks: list[Chunk] = []
        self._kept: OrderedDict[int, bytes] = OrderedDict()
        self._lock = threading.RLock()

    def bytes_at(self, position: int, count: int) -> bytes:
        """Return exactly `count` bytes.

        Raises:
            DamagedFrameError: if the file ends before, or the count is too large.
        """
        if not 0 <= count <= LARGEST_CHUNK or position < 0:
            raise DamagedFrameError(f"{self.path}: a record must have at most {LARGEST_CHUNK:,} bytes, found {count:,}")
        with self._lock:
            self.file.seek(position)
            data = self.file.read(count)
        if len(data) != count:
            raise DamagedFrameError(f"{self.path} ends at byte {self.size:,}, in the middle of a record")
        return data

    def chunk(self, number: int) -> bytes:
        """Return a decompressed chunk, from memory if it was used lately.

        Raises:
            DamagedFrameError: if it is damaged, or larger than the bound.
        """
        with self._lock:
            if number in self._kept:
                self._kept.move_to_end(number)
                return self._kept[number]
            chunk = self.chunks[number]
            compressed = self.bytes_at(chunk.position, chunk.length)
            data = decompress(compressed, chunk.compression, chunk.size, str(self.path))
            self._kept[number] = data
            while len(self._kept) > _CACHED_CHUNKS:
                self._kept.popitem(last=False)
            return data

    def close(self) -> None:
        """Close the file."""
        self.file.close()


def decompress(data: bytes, compression: str, size: int, where: str) -> bytes:
    """Return a chunk; no more memory is used than its declared size.

    Raises:
        DamagedFrameError: if the data is damaged, the size is wrong or too large, or the compression is unknown.
        MissingExtraError: if the library of the compression is not installed.
    """
    if not 0 <= size <= LARGEST_CHUNK:
        raise DamagedFrameError(f"{where}: a chunk must have at most {LARGEST_CHUNK:,} bytes, found {size:,}")
    if compression in ("", "none"):
        found = data
    else:
        # One byte more than declared shows that a chunk is longer.
        run = _decompressor(compression, where)
        try:
            found = run(data, max_length=size + 1)
        except (OSError, RuntimeError, ValueError, EOFError, _zstd_error()) as error:
            raise DamagedFrameError(f"{where}: a chunk cannot be decompressed: {error}") from error
    if len(found) != size:
        raise DamagedFrameError(f"{where}: a chunk must have {size:,} bytes, found {len(found):,} or more")
    return found


def zstd() -> Any:
    """Return the module for Zstandard. Raises MissingExtraError."""
    try:
        if sys.version_info >= (3, 14):
            from compression import zstd as module
        else:
            from backports import zstd as module
    except ImportError as error:
        raise MissingExtraError("reading compressed bags", "bags") from error
    return module


def _zstd_error() -> type[Exception]:
    try:
        return zstd().ZstdError
    except MissingExtraError:
        return ValueError


def _decompressor(compression: str, where: str) -> Callable[..., bytes]:
    if compression == "bz2":
        return bz2.BZ2Decompressor().decompress
    if compression == "zstd":
        return zstd().ZstdDecompressor().decompress
    if compression == "lz4":
        try:
            import lz4.frame
        except ImportError as error:
            raise MissingExtraError("reading compressed bags", "bags") from error
        return lz4.frame.LZ4FrameDecompressor().decompress
    raise DamagedFrameError(f"{where}: chunks must be compressed by lz4, zstd or bz2, found {compression[:20]!r}")
