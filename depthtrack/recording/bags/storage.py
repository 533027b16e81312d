"""Topics of a container of messages, and an index of the messages by time."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

import numpy as np

from depthtrack.errors import InputError
from depthtrack.types import Index

Serialisation = Literal["ros1", "cdr"]

MAX_MESSAGES = 4_000_000
"""Bound on the messages of a topic."""
TOP = -1
"""Chunk number of messages outside chunks."""


@dataclass(frozen=True)
class Topic:
    """Name and type of a topic.

    kind: "sensor_msgs/msg/Image".
    definition: of the message type, if the file states it.
    """

    name: str
    kind: str
    definition: str = ""


class Storage(Protocol):
    """An opened container. Messages of a topic are numbered in order of their times."""

    path: Path
    serialisation: Serialisation
    topics: dict[str, Topic]
    cut: str | None
    """Where the file is cut short, in words; None if it is complete."""

    def times(self, topic: str) -> Index:
        """Return the time (N,) of each message, nanoseconds, in order."""
        ...

    def read(self, topic: str, index: int, most: int | None = None) -> bytes:
        """Return a message, or its first `most` bytes.

        Raises:
            DamagedFrameError: if it cannot be read.
        """
        ...

    def close(self) -> None: ...


class MessageIndex:
    """Times and places of the messages of one topic, in order of time."""

    def __init__(self) -> None:
        self._rows: list[tuple[int, int, int]] = []
        self._sorted: Index | None = None

    def add(self, time: int, chunk: int, offset: int) -> None:
        """Add a message at an offset within a chunk. Raises InputError if there are too many."""
        if len(self._rows) >= MAX_MESSAGES:
            raise InputError(f"a topic must have at most {MAX_MESSAGES:,} messages, found more: split the recording")
        self._rows.append((time, chunk, offset))

    def __len__(self) -> int:
        return len(self._rows) if self._sorted is None else len(self._sorted)

    @property
    def rows(self) -> Index:
        """Time (ns), chunk and offset (N, 3) of each message."""
        if self._sorted is None:
            rows = np.array(self._rows, dtype=np.int64).reshape(-1, 3)
            self._sorted = rows[np.argsort(rows[:, 0], kind="stable")]
            self._rows.clear()
        return self._sorted


class ConnectionIndex:
    """Messages by connection (ROS 1) or channel (MCAP); several may have one topic."""

    def __init__(self) -> None:
        self._topics: dict[int, Topic] = {}
        self._messages: dict[int, MessageIndex] = {}
        self._merged: dict[str, Index] = {}

    @property
    def topics(self) -> dict[str, Topic]:
        """Topics by name."""
        return {topic.name: topic for topic in self._topics.values()}

    def define(self, connection: int, topic: Topic) -> None:
        """State the topic of a connection."""
        self._topics[connection] = topic

    def add(self, connection: int, time: int, chunk: int, offset: int) -> None:
        """Add a message; see `MessageIndex.add`."""
        self._messages.setdefault(connection, MessageIndex()).add(time, chunk, offset)

    def undefined(self) -> Iterator[tuple[int, int]]:
        """Yield each connection whose topic is unknown, and the first chunk with a message of it."""
        for connection, messages in self._messages.items():
            if connection not in self._topics and (first := int(messages.rows[:, 1].min())) != TOP:
                yield connection, first

    def is_defined(self, connection: int) -> bool:
        """Return whether the topic of a connection is known."""
        return connection in self._topics

    def rows(self, topic: str) -> Index:
        """Return time (ns), chunk and offset (N, 3) of the messages of a topic, in order of time."""
        if topic not in self._merged:
            merged = MessageIndex()
            for connection, each in self._topics.items():
                if each.name == topic and connection in self._messages:
                    for row in self._messages[connection].rows.tolist():
                        merged.add(*row)
            self._merged[topic] = merged.rows
        return self._merged[topic]
