"""Files of 2D keypoints from elsewhere: 21 points of a hand in each image.

The first line is `timestamp` (s) or `frame` (from 0), perhaps `side`, then x, y and confidence of each landmark, by
MediaPipe's names. Each further line is one image. A keypoint with a blank cell is unknown. See docs/keypoints.md.
"""

import math
from array import array
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast, get_args

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.errors import InputError
from depthtrack.files import read_lines
from depthtrack.hand.shape import Side
from depthtrack.number_text import parse_number
from depthtrack.recording.colour_association import MAX_COLOUR_DELAY, associate
from depthtrack.recording.sequence import Frame, ImageKeypoints
from depthtrack.recording.sequences.tum_lists import MAX_FRAMES
from depthtrack.types import Array, Index

LANDMARK_NAMES = (
    "wrist",
    *(f"thumb_{joint}" for joint in ("cmc", "mcp", "ip", "tip")),
    *(
        f"{finger}_{joint}"
        for finger in ("index_finger", "middle_finger", "ring_finger", "pinky")
        for joint in ("mcp", "pip", "dip", "tip")
    ),
)
"""MediaPipe's names of the keypoints `kinematics.KEYPOINT_NAMES`, in the same order."""
COLUMNS = tuple(f"{name}_{value}" for name in LANDMARK_NAMES for value in ("x", "y", "confidence"))
HEADER = ("timestamp", "side", *COLUMNS)
"""Columns of a file with time stamps and sides."""
KEYPOINTS_FILE = "keypoints.csv"
"""Name of the file beside a synthetic recording."""
MAX_BYTES = 1 << 27
"""Largest file read: an hour at 30 Hz has half as much."""
_LONGEST_LINE, _FARTHEST = 4096, 1e5
"""Characters of a line, and pixels of a coordinate, at most."""


@dataclass(frozen=True)
class KeypointFile:
    """The keypoints of T images.

    keys: (T,) times in seconds, or numbers of frames, increasing.
    timed: whether the keys are times.
    pixels: (T, 21, 2) in the depth image; NaN if unknown.
    confidence: (T, 21) 0 to 1; 0 if unknown.
    sides: (T,) sides by the detector, None if unknown.
    """

    keys: Array
    timed: bool
    pixels: Array
    confidence: Array
    sides: tuple[Side | None, ...]

    def __len__(self) -> int:
        return len(self.keys)

    def __getitem__(self, row: int) -> ImageKeypoints:
        return ImageKeypoints(self.pixels[row], self.confidence[row], self.sides[row])

    @property
    def side(self) -> Side | None:
        """The side of most images; None if the file states none."""
        counts = Counter(side for side in self.sides if side is not None)
        return counts.most_common(1)[0][0] if counts else None

    def rows(self, timestamps: ArrayLike) -> Index:
        """Return the row of each frame (N,), -1 without one.

        timestamps: (N,) of the frames, seconds. The nearest row within half the median interval belongs to a frame.
        """
        times = np.asarray(timestamps, dtype=np.float64)
        found = np.full(len(times), -1)
        if not self.timed:
            numbers = self.keys.astype(np.int64)
            inside = numbers < len(times)
            found[numbers[inside]] = np.flatnonzero(inside)
            return found
        half = float(np.median(np.diff(times))) / 2 if len(times) > 1 else MAX_COLOUR_DELAY
        for frame, row in associate(times, self.keys, half).items():
            found[frame] = row
        return found

    def attach(self, frames: Iterable[Frame], timestamps: ArrayLike) -> Iterator[Frame]:
        """Yield the frames of a recording with their keypoints.

        timestamps: (N,) of all its frames, seconds.
        """
        rows = self.rows(timestamps)
        for frame in frames:
            row = int(rows[frame.index])
            yield frame if row < 0 else replace(frame, keypoints=self[row])


def read_keypoints(path: Path) -> KeypointFile:
    """Return the keypoints of a file.

    Raises:
        InputError: if the file is unreadable or malformed; the message states the line.
    """
    lines = read_lines(path, MAX_BYTES)
    header = next(lines, "").strip().split(",")
    first, stated = (header[0] if header else ""), header[1:2] == ["side"]
    if first not in ("timestamp", "frame") or tuple(header[2 if stated else 1 :]) != COLUMNS:
        start = ",".join(header[:4])[:60]
        raise InputError(
            f"{path}: the header must be 'timestamp' or 'frame', perhaps 'side', "
            f"then '{COLUMNS[0]},...,{COLUMNS[-1]}', found {len(header)} fields beginning with {start!r}"
        )
    keys, values, sides = array("d"), array("d"), list[Side | None]()
    for number, line in enumerate(lines, start=2):
        where = f"{path}, line {number}"
        if len(keys) == MAX_FRAMES:
            raise InputError(f"{path} must have at most {MAX_FRAMES:,} rows: split the recording")
        cells = _cells(line, len(header), where)
        keys.append(_key(cells[0], first == "timestamp", keys[-1] if keys else -math.inf, where))
        sides.append(_side(cells[1], where) if stated else None)
        for cell, name in zip(cells[-len(COLUMNS) :], COLUMNS, strict=True):
            values.append(_number(cell, name, where))
    if not keys:
        raise InputError(f"{path} must hold rows below its header, found none")
    table = np.array(values).reshape(-1, len(LANDMARK_NAMES), 3)
    table[~np.isfinite(table).all(axis=-1)] = np.nan
    return KeypointFile(
        np.array(keys), first == "timestamp", table[..., :2], np.nan_to_num(table[..., 2], nan=0.0), tuple(sides)
    )


def keypoint_cells(keypoints: ImageKeypoints) -> list[str]:
    """Return the cells of an image after its time: side, then each keypoint's x, y, confidence."""
    cells: Sequence[str] = [
        "" if not np.isfinite(pixel).all() else f"{value:.3f}"
        for pixel, confidence in zip(keypoints.pixels, keypoints.confidence, strict=True)
        for value in (*pixel, confidence)
    ]
    return [keypoints.side or "", *cells]


def _cells(line: str, count: int, where: str) -> list[str]:
    if len(line) > _LONGEST_LINE:
        raise InputError(f"{where}: a line must have at most {_LONGEST_LINE} characters, found {len(line):,}")
    cells = [cell.strip() for cell in line.split(",")]
    if len(cells) != count:
        raise InputError(f"{where}: expected {count} cells as in the header, found {len(cells)}")
    return cells


def _key(text: str, timed: bool, last: float, where: str) -> float:
    """Return the time or the number of the frame. Raises InputError unless it increases."""
    what = "a time in seconds" if timed else "the number of a frame from 0"
    value = _float(text)
    if not math.isfinite(value) or (not timed and not (0 <= value < MAX_FRAMES and value == int(value))):
        raise InputError(f"{where}: expected {what}, found {text[:40]!r}")
    if value <= last:
        raise InputError(f"{where}: expected more than {last:.10g}, found {value:.10g}: keep one hand in each image")
    return value


def _side(text: str, where: str) -> Side | None:
    if text not in ("", *get_args(Side)):
        raise InputError(f"{where}: the side must be right, left or blank, found {text[:40]!r}")
    return cast(Side, text) if text else None


def _number(text: str, name: str, where: str) -> float:
    """Return the number in a cell, NaN if it is blank. Raises InputError."""
    if not text:
        return math.nan
    value, largest = _float(text), _FARTHEST
    least = -largest
    if name.endswith("_confidence"):
        least, largest = 0.0, 1.0
    if not least <= value <= largest:
        raise InputError(
            f"{where}: {name} must be a number from {least:g} to {largest:g} or blank, found {text[:40]!r}"
        )
    return value


def _float(text: str) -> float:
    try:
        return parse_number(text)
    except ValueError:
        return math.nan
