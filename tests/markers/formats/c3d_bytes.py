"""C3D files made byte by byte after the guide, independent of the package."""

import struct
from dataclasses import dataclass, field
from typing import Literal

import numpy as np


@dataclass(frozen=True)
class C3dFile:
    """A file of T frames of M points (T, M, 4): x, y, z and the fourth word.

    extra: further parameters of POINT and TRIAL by `GROUP:NAME`, as the bytes from their type on.
    header: words of the header to replace, by their number from 1.
    """

    points: np.ndarray
    labels: tuple[str, ...] = ()
    processor: Literal["intel", "dec", "mips"] = "intel"
    scale: float = -1.0
    rate: float = 100.0
    units: str = "mm"
    first_frame: int = 1
    analogs: np.ndarray | None = None
    extra: dict[str, bytes] = field(default_factory=dict)
    header: dict[int, int] = field(default_factory=dict)

    def to_bytes(self) -> bytes:
        """Return the file."""
        section = self._section(0)
        blocks = -(-len(section) // 512)
        section = self._section(2 + blocks).ljust(512 * blocks, b"\0")
        frames, count = self.points.shape[:2]
        analogs = 0 if self.analogs is None else self.analogs.shape[1]
        last = self.first_frame + frames - 1
        words = {2: count, 3: analogs, 4: self.first_frame, 5: last & 0xFFFF, 6: 10, 9: 2 + blocks, 10: 1}
        head = bytearray(512)
        head[:2] = b"\x02\x50"
        for number, word in {**words, **self.header}.items():
            head[2 * number - 2 : 2 * number] = self.word(word)
        head[12:16], head[20:24] = self.real(self.scale), self.real(self.rate)
        values = self.points.reshape(frames, -1)
        if self.analogs is not None:
            values = np.concatenate([values, self.analogs], axis=1)
        data = b"".join((self.real if self.scale < 0 else self.signed)(value) for value in values.ravel().tolist())
        return bytes(head) + section + data.ljust(-(-len(data) // 512) * 512, b"\0")

    def word(self, value: int) -> bytes:
        return struct.pack(">H" if self.processor == "mips" else "<H", value)

    def signed(self, value: float) -> bytes:
        return struct.pack(">h" if self.processor == "mips" else "<h", int(value))

    def real(self, value: float) -> bytes:
        if self.processor == "dec":
            low, high = struct.unpack("<HH", struct.pack("<f", value * 4))
            return struct.pack("<HH", high, low)
        return struct.pack(">f" if self.processor == "mips" else "<f", value)

    def strings(self, rows: tuple[str, ...]) -> bytes:
        width = max(map(len, rows), default=0)
        return bytes([0xFF, 2, width, len(rows)]) + "".join(row.ljust(width) for row in rows).encode() + b"\0"

    def _section(self, data_block: int) -> bytes:
        frames, count = self.points.shape[:2]
        parameters = {
            "POINT:USED": b"\2\0" + self.word(count) + b"\0",
            "POINT:SCALE": b"\4\0" + self.real(self.scale) + b"\0",
            "POINT:RATE": b"\4\0" + self.real(self.rate) + b"\0",
            "POINT:DATA_START": b"\2\0" + self.word(data_block) + b"\0",
            "POINT:FRAMES": b"\2\0" + self.word(min(frames, 65535)) + b"\0",
            "POINT:UNITS": self.strings((self.units,)),
            "POINT:LABELS": self.strings(self.labels[:255]),
            **({"POINT:LABELS2": self.strings(self.labels[255:])} if len(self.labels) > 255 else {}),
            **self.extra,
        }
        numbers = {"POINT": 1, "TRIAL": 2, "ANALOG": 3}
        records = [self._record(name, -number, b"\0") for name, number in numbers.items()]
        records += [
            self._record(key[key.index(":") + 1 :], numbers[key[: key.index(":")]], body)
            for key, body in parameters.items()
        ]
        code = {"intel": 84, "dec": 85, "mips": 86}[self.processor]
        return bytes([1, 0x50, 1, code]) + b"".join(records) + b"\0\0"

    def _record(self, name: str, group: int, body: bytes) -> bytes:
        return struct.pack("<bb", len(name), group) + name.encode() + self.word(len(body) + 2) + body
