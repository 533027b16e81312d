"""Opening of the containers of messages, and of folders with several of them."""

import re
from pathlib import Path

import numpy as np

from depthtrack.errors import InputError
from depthtrack.files import open_regular
from depthtrack.recording.bags import mcap, ros1, sqlite
from depthtrack.recording.bags.mcap import McapStorage
from depthtrack.recording.bags.ros1 import Ros1Storage
from depthtrack.recording.bags.sqlite import SqliteStorage
from depthtrack.recording.bags.storage import Serialisation, Storage, Topic
from depthtrack.types import Index

_KINDS: tuple[tuple[bytes, type[Storage]], ...] = (
    (mcap.MAGIC, McapStorage),
    (ros1.MAGIC, Ros1Storage),
    (sqlite.MAGIC, SqliteStorage),
)
_ZSTD = b"\x28\xb5\x2f\xfd"
_MOST_PARTS = 10_000


class SplitStorage:
    """A folder of files that continue each other; see `Storage`."""

    def __init__(self, path: Path, parts: list[Storage]) -> None:
        self.path, self._parts = path, parts
        self.serialisation: Serialisation = parts[0].serialisation
        self.topics: dict[str, Topic] = {}
        for part in parts:
            self.topics |= part.topics
        self.cut = next((f"{part.path.name}: {part.cut}" for part in parts if part.cut is not None), None)
        self._places: dict[str, Index] = {}

    def times(self, topic: str) -> Index:
        """See `Storage`."""
        return self._rows(topic)[:, 0]

    def read(self, topic: str, index: int, most: int | None = None) -> bytes:
        """See `Storage`."""
        _, part, place = (int(value) for value in self._rows(topic)[index])
        return self._parts[part].read(topic, place, most)

    def close(self) -> None:
        """Close all files."""
        for part in self._parts:
            part.close()

    def _rows(self, topic: str) -> Index:
        """Return time, part and index within the part (N, 3) of each message."""
        if topic not in self._places:
            rows = [
                np.column_stack([times, np.full(len(times), number), np.arange(len(times))])
                for number, part in enumerate(self._parts)
                if topic in part.topics and len(times := part.times(topic))
            ]
            joined = np.concatenate(rows) if rows else np.zeros((0, 3), dtype=np.int64)
            self._places[topic] = joined[np.argsort(joined[:, 0], kind="stable")]
        return self._places[topic]


def is_bag(path: Path) -> bool:
    """Return whether a path holds messages: a file of a known container, or a folder of them."""
    if path.is_dir():
        # A folder with lists of images may hold the file that they were made from.
        return not (path / "depth.txt").exists() and any(
            _kind_of(part) is not None or _is_compressed(part) for part in _parts_of(path)
        )
    return _kind_of(path) is not None or _is_compressed(path)


def open_storage(path: Path) -> Storage:
    """Return the opened container.

    Raises:
        InputError: if it is damaged beyond reading, or compressed as a whole.
    """
    paths = _parts_of(path) if path.is_dir() else [path]
    if len(paths) > _MOST_PARTS:
        raise InputError(f"{path} must hold at most {_MOST_PARTS} files, found {len(paths)}")
    for part in paths:
        if _is_compressed(part):
            raise InputError(f"{part} is compressed as a whole: run  zstd -d {part.name}  in its folder first")
    parts = [kind(part) for part in paths if (kind := _kind_of(part)) is not None]  # type: ignore[call-arg]
    return parts[0] if len(parts) == 1 else SplitStorage(path, parts)


def _parts_of(folder: Path) -> list[Path]:
    """Return the files of a ROS 2 folder in the order of their numbers."""
    names = [each for each in folder.iterdir() if each.suffix in (".db3", ".mcap", ".zstd", ".zst") and each.is_file()]
    return sorted(names, key=lambda each: [int(text) if text.isdigit() else text for text in _split(each.name)])


def _split(name: str) -> list[str]:
    """Return text and numbers of a name in turn, so that part 10 follows part 9."""
    return re.split(r"(\d+)", name)


def _kind_of(path: Path) -> type[Storage] | None:
    start = _start_of(path)
    kind = next((kind for magic, kind in _KINDS if start.startswith(magic)), None)
    # Other programs keep their own data in SQLite.
    return None if kind is SqliteStorage and path.suffix.lower() not in (".db3", ".bag") else kind


def _is_compressed(path: Path) -> bool:
    return path.suffix in (".zstd", ".zst") and _start_of(path).startswith(_ZSTD)


def _start_of(path: Path) -> bytes:
    try:
        with open_regular(path) as file:
            return file.read(16)
    except OSError:
        return b""
