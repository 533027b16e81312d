"""Bags of ROS 2 in SQLite (`.db3`), also those of the RealSense SDK.

A file that is cut short is read in the order of its rows, up to the first page that is missing.
"""

import sqlite3
import threading
from pathlib import Path
from urllib.parse import quote

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.recording.bags.chunks import LARGEST_CHUNK, decompress, zstd
from depthtrack.recording.bags.storage import MessageIndex, Serialisation, Topic
from depthtrack.types import Index

MAGIC = b"SQLite format 3\0"
_ZSTD = b"\x28\xb5\x2f\xfd"
"""First bytes of a message that ROS 2 compressed on its own."""


class SqliteStorage:
    """A `.db3` file; see `Storage`."""

    serialisation: Serialisation = "cdr"

    def __init__(self, path: Path) -> None:
        """Index the file.

        Raises:
            InputError: if it has no table of messages.
        """
        self.path = path
        self.cut: str | None = None
        self._lock = threading.Lock()
        self._database = _opened(path)
        self._indexes: dict[str, MessageIndex] = {}
        try:
            names = self._database.execute("SELECT id, name, type FROM topics").fetchmany(10_000)
        except sqlite3.Error as error:
            raise InputError(f"{path} must have the tables of a ROS 2 bag, found: {error}") from error
        topics = {int(number): Topic(str(name), str(kind)) for number, name, kind in names}
        self.topics = {topic.name: topic for topic in topics.values()}
        self._scan(topics)

    def times(self, topic: str) -> Index:
        """See `Storage`."""
        return self._indexes[topic].rows[:, 0] if topic in self._indexes else MessageIndex().rows[:, 0]

    def read(self, topic: str, index: int, most: int | None = None) -> bytes:
        """See `Storage`."""
        row = int(self._indexes[topic].rows[index, 1])
        column = "data" if most is None else f"substr(data, 1, {int(most)})"
        with self._lock:
            try:
                found = self._database.execute(
                    f"SELECT length(data), {column} FROM messages WHERE id = ?", (row,)
                ).fetchone()
            except (sqlite3.Error, OverflowError) as error:
                raise DamagedFrameError(f"{self.path}: message {row} cannot be read: {error}") from error
        if found is None or not isinstance(found[1], bytes) or found[0] > LARGEST_CHUNK:
            raise DamagedFrameError(f"{self.path}: message {row} is missing or longer than {LARGEST_CHUNK:,} bytes")
        data = found[1]
        if data[:4] != _ZSTD:
            return data
        if most is not None and len(data) == most:
            return self.read(topic, index)[:most]
        size = zstd().get_frame_size(data)
        declared = zstd().get_frame_info(data).decompressed_size
        return decompress(data[:size], "zstd", declared if declared is not None else -1, str(self.path))

    def close(self) -> None:
        """Close the database."""
        self._database.close()

    def _scan(self, topics: dict[int, Topic]) -> None:
        """Index all rows in the order that they were written."""
        try:
            rows = self._database.execute("SELECT id, topic_id, timestamp FROM messages ORDER BY id")
            for row, number, time in rows:
                if number in topics and isinstance(time, int):
                    self._indexes.setdefault(topics[number].name, MessageIndex()).add(time, row, 0)
        except sqlite3.Error as error:
            self.cut = f"the database is damaged ({error})"


def _opened(path: Path) -> sqlite3.Connection:
    """Return a connection that writes nothing.

    A write-ahead log beside the file is read too. Otherwise the file is opened without its journal, which a
    recorder that was killed may have left.
    """
    log = path.with_name(path.name + "-wal")
    for mode in ("mode=ro", "immutable=1") if log.exists() else ("immutable=1",):
        try:
            database = sqlite3.connect(f"file:{quote(str(path.resolve()))}?{mode}", uri=True, check_same_thread=False)
            # SQLite refuses a file that is shorter than its header states, unless its schema is writable.
            database.execute("PRAGMA writable_schema=ON")
            database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LARGEST_CHUNK)
            database.execute("SELECT count(*) FROM sqlite_master").fetchone()
            return database
        except sqlite3.Error as error:
            last = error
    raise InputError(f"cannot read {path}: {last}") from last
