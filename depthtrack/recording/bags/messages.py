"""Decoding of messages with the library rosbags.

Messages of ROS 2 are decoded with the standard definitions. A ROS 1 bag states its own, which may extend them.
"""

import re
import struct
from typing import Any

import numpy as np

from depthtrack.errors import DamagedFrameError, InputError, MissingExtraError
from depthtrack.recording.bags.storage import Storage, Topic
from depthtrack.types import Index

_STAMP_BYTES = 16
_LONGEST_DEFINITION, _LONGEST_ARRAY = 1 << 18, 4096
"""Characters of a message definition, and elements of an array of fixed length in it: code is generated from both."""


class Messages:
    """Messages of an opened container by topic, and the time stamps in their headers.

    Raises:
        MissingExtraError: if rosbags is not installed.
    """

    def __init__(self, storage: Storage) -> None:
        try:
            from rosbags.typesys import Stores, get_typestore
        except ImportError as error:
            raise MissingExtraError("reading bags", "bags") from error
        self.storage = storage
        self._ros1 = storage.serialisation == "ros1"
        self._types = get_typestore(Stores.ROS1_NOETIC if self._ros1 else Stores.ROS2_HUMBLE)
        self._own: dict[str, Any] = {}

    @property
    def topics(self) -> dict[str, Topic]:
        """Topics that have a message, by name."""
        return {name: topic for name, topic in self.storage.topics.items() if len(self.storage.times(name))}

    def first(self, topic: str) -> Any:
        """Return the first message of a topic that can be decoded.

        Raises:
            DamagedFrameError: if none of the first ones can.
        """
        last = DamagedFrameError(f"{self.storage.path}: topic {topic} has no message")
        for index in range(min(30, len(self.storage.times(topic)))):
            try:
                return self.decode(topic, index)
            except DamagedFrameError as error:
                last = error
        raise last

    def decode(self, topic: str, index: int) -> Any:
        """Return a message with the fields of its type.

        Raises:
            DamagedFrameError: if it cannot be read, or its bytes are no such message.
        """
        data, kind = self.storage.read(topic, index), self.storage.topics[topic].kind
        try:
            if self._ros1:
                return self._types_of(self.storage.topics[topic]).deserialize_ros1(data, kind)
            return self._types.deserialize_cdr(data, kind)
        except Exception as error:  # generated code raises many types for damaged messages
            raise DamagedFrameError(
                f"{self.storage.path}: message {index} of {topic} is no {kind} ({type(error).__name__})"
            ) from error

    def stamps(self, topic: str) -> Index:
        """Return the time (N,) of each message, nanoseconds: of its header or its recording.

        The latter is taken if the headers of the topic state no times.
        """
        recorded = self.storage.times(topic)
        stamps = np.zeros_like(recorded)
        for index in range(len(recorded)):
            try:
                stamps[index] = self._stamp(self.storage.read(topic, index, _STAMP_BYTES))
            except DamagedFrameError:
                stamps[index] = 0
        known = stamps > 0
        if not np.any(known[1:]):
            return recorded
        # A message without a stamp is placed by when it was recorded.
        offset = int(np.median((stamps - recorded)[known]))
        return np.where(known, stamps, recorded + offset)

    def _stamp(self, data: bytes) -> int:
        """Return the time of the header that a message begins with, nanoseconds; 0 if it is cut."""
        if len(data) < 12:
            return 0
        # Four bytes precede the time: the number of a ROS 1 header, or the byte order of CDR.
        is_little = self._ros1 or data[1] & 1
        seconds, nanoseconds = struct.unpack_from("<II" if is_little else ">II", data, 4)
        return int(seconds) * 10**9 + int(nanoseconds)

    def _types_of(self, topic: Topic) -> Any:
        """Return the type store with the definition that a ROS 1 bag states for a topic."""
        if topic.name not in self._own:
            from rosbags.typesys import Stores, get_types_from_msg, get_typestore

            lengths = re.findall(r"\[(?:<=)?(\d+)\]", topic.definition)
            is_long = any(len(length) > 4 or int(length) > _LONGEST_ARRAY for length in lengths)
            if is_long or len(topic.definition) > _LONGEST_DEFINITION:
                raise InputError(f"{self.storage.path}: the definition of {topic.name[:60]} is too long")
            store = get_typestore(Stores.EMPTY)
            store.register(get_types_from_msg(topic.definition, topic.kind))
            self._own[topic.name] = store
        return self._own[topic.name]
