"""The text files of a TUM RGB-D folder (`timestamp filename` a line) and how two of them are brought together.

Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012, and its tool `associate.py`.
"""

import heapq
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from depthtrack.errors import InputError
from depthtrack.files import read_lines

MAX_FRAMES = 1_000_000
"""Most images in one list: nine hours at 30 Hz."""
MAX_LIST_BYTES = 1 << 26
"""Largest list file read: room for that many lines, and a bound on what an absurd file can take."""
MAX_COLOUR_DELAY = 0.02
"""Largest difference of timestamps, in seconds, at which a colour image still belongs to a depth image."""


@dataclass(frozen=True, slots=True)
class ListedFile:
    """One line of a list: when the image was taken (seconds) and its name within the folder."""

    timestamp: float
    name: str


def read_list(folder: Path, list_name: str) -> list[ListedFile]:
    """Lines of `depth.txt` or `rgb.txt`: at least one, strictly in order of time, every file within `folder`.

    Whether the files exist and are sound is found out frame by frame. Raises InputError.
    """
    path = folder / list_name
    files: list[ListedFile] = []
    inside = _Inside(folder)
    for number, line in enumerate(read_lines(path, MAX_LIST_BYTES), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        file = _parse(line, f"{path}, line {number}")
        if files and file.timestamp <= files[-1].timestamp:
            raise InputError(
                f"{path}, line {number}: timestamps must increase, found {file.timestamp} after {files[-1].timestamp}:"
                " sort the list by time and drop double entries"
            )
        if not inside.holds(file.name):
            raise InputError(
                f"{path}, line {number}: the file {file.name!r} must lie within the folder of the recording"
            )
        if len(files) == MAX_FRAMES:
            raise InputError(f"{path} lists more than {MAX_FRAMES:,} images: split the recording")
        files.append(file)
    if not files:
        raise InputError(f"{path} lists no image: expected lines of the form 'timestamp filename'")
    return files


def associate(
    depth: Sequence[float], colour: Sequence[float], max_difference: float = MAX_COLOUR_DELAY
) -> dict[int, int]:
    """Index into `colour` for each index into `depth` that has a partner; both strictly increasing, in seconds.

    As TUM's associate.py: of all pairs closer than `max_difference` the closest is joined first, each image once.
    That tool looks at every pair. The closest pair of what is left is always adjacent in time, so a heap of adjacent
    pairs gives the same answer in O(n log n).
    """
    events = sorted([(t, 0, i) for i, t in enumerate(depth)] + [(t, 1, i) for i, t in enumerate(colour)])
    before, after = list(range(-1, len(events) - 1)), list(range(1, len(events) + 1))
    heap: list[tuple[float, float, float, int, int]] = []

    def offer(left: int, right: int) -> None:
        """Make two neighbours in time a candidate, unless they are of one kind or too far apart."""
        if left < 0 or right >= len(events) or events[left][1] == events[right][1]:
            return
        first, second = (left, right) if events[left][1] == 0 else (right, left)
        difference = abs(events[left][0] - events[right][0])
        if difference < max_difference:
            heapq.heappush(heap, (difference, events[first][0], events[second][0], first, second))

    for left in range(len(events) - 1):
        offer(left, left + 1)
    partner: dict[int, int] = {}
    joined = [False] * len(events)
    while heap:
        *_, first, second = heapq.heappop(heap)
        if joined[first] or joined[second]:
            continue
        joined[first] = joined[second] = True
        partner[events[first][2]] = events[second][2]
        left, right = before[min(first, second)], after[max(first, second)]
        if left >= 0:
            after[left] = right
        if right < len(events):
            before[right] = left
        offer(left, right)
    return partner


def _parse(line: str, where: str) -> ListedFile:
    fields = line.split(maxsplit=1)
    try:
        timestamp = float(fields[0])
    except ValueError:
        timestamp = math.nan
    if len(fields) != 2 or not math.isfinite(timestamp):
        raise InputError(f"{where}: expected 'timestamp filename' with the time in seconds, found {line[:80]!r}")
    return ListedFile(timestamp, fields[1].strip())


class _Inside:
    """Tells whether a listed name stays within a folder; links are followed, each directory once.

    Plain strings: a list has one name for every frame, and path objects would take longer than reading it.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = str(folder)
        self._root = Path(os.path.realpath(folder))
        self._directories: dict[str, bool] = {}

    def holds(self, name: str) -> bool:
        # Backslashes and drive letters lead elsewhere on Windows; names that cannot be printed could steer a terminal.
        if (
            name.startswith("/")
            or name[1:2] == ":"
            or "\\" in name
            or ".." in name.split("/")
            or not name.isprintable()
        ):
            return False
        directory = name.rpartition("/")[0]
        if directory not in self._directories:
            self._directories[directory] = self._leads_inside(directory)
        is_link = os.path.islink(f"{self._folder}/{name}")
        return self._directories[directory] and (not is_link or self._leads_inside(name))

    def _leads_inside(self, name: str) -> bool:
        return Path(os.path.realpath(f"{self._folder}/{name}")).is_relative_to(self._root)


def is_inside(folder: Path, name: str) -> bool:
    """Whether the file `name` of `folder` lies within it, links followed."""
    return _Inside(folder).holds(name)
