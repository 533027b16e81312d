"""Mutations of PNG images that keep the checksums right, so that decoders meet the lie."""

import struct
import zlib

import numpy as np

_SIZES = (0, 1, 2, 31, 33, 65535, 2**20, 2**31 - 1, 2**32 - 1)


def chunks(data: bytes) -> list[tuple[bytes, bytes]]:
    """Return name and content of the chunks of a PNG."""
    found, place = [], 8
    while place + 8 <= len(data):
        length = int.from_bytes(data[place : place + 4], "big")
        found.append((data[place + 4 : place + 8], data[place + 8 : place + 8 + length]))
        place += 12 + length
    return found


def joined(parts: list[tuple[bytes, bytes]]) -> bytes:
    """Return the PNG of chunks, with right lengths and checksums."""
    out = b"\x89PNG\r\n\x1a\n"
    for name, content in parts:
        out += len(content).to_bytes(4, "big") + name + content + struct.pack(">I", zlib.crc32(name + content))
    return out


def change_png(data: bytes, rng: np.random.Generator) -> bytes:
    """Return a PNG of another stated size or type, with other pixels, or with other chunks."""
    parts = chunks(data)
    if not parts:
        return data
    chosen = int(rng.integers(len(parts)))
    match int(rng.integers(6)):
        case 0:
            width, height = (int(rng.choice(_SIZES)) for _ in range(2))
            parts[0] = (b"IHDR", struct.pack(">2I", width, height) + parts[0][1][8:])
        case 1:
            header = bytearray(parts[0][1])
            header[8 + int(rng.integers(5))] = int(rng.integers(256))
            parts[0] = (b"IHDR", bytes(header))
        case 2:
            bomb = zlib.compress(bytes(int(rng.choice([0, 10, 1000, 30_000_000]))), 9)
            parts = [(name, bomb if name == b"IDAT" else content) for name, content in parts]
        case 3:
            del parts[chosen]
        case 4:
            parts.insert(int(rng.integers(len(parts) + 1)), parts[chosen])
        case _:
            name = bytes(rng.choice(list(b"acPLTEtRNSzTXtiCCPeXIf"), 4).astype(np.uint8))
            parts.insert(1, (name, zlib.compress(bytes(5_000_000)) if rng.random() < 0.5 else bytes(50)))
    return joined(parts)
