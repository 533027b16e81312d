"""Times by the clock of a RealSense camera.

The headers of images in a `.db3` of the SDK hold the time at which the recorder received them, which varies with the
load of the computer. The camera's own time is in the metadata beside each image, in milliseconds:

    /device_0/sensor_0/Depth_0/image/data
    /device_0/sensor_0/Depth_0/image/metadata    std_msgs/String: timestamp_domain=Hardware Clock;timestamp=33.3;...

Source: librealsense 2.58, rosbag2 writer.
"""

import re
from collections.abc import Iterable

import numpy as np

from depthtrack.errors import DamagedFrameError
from depthtrack.recording.bags.messages import Messages
from depthtrack.types import Index

_STRING = "std_msgs/msg/String"
_TIME = re.compile(r"(?:^|;)timestamp=(\d{1,15}(?:\.\d{1,9})?)(?:;|$)")
_CLOCK = re.compile(r"(?:^|;)timestamp_domain=([^;]{1,40})")


def camera_stamps(messages: Messages, topics: Iterable[str]) -> dict[str, Index]:
    """Return the times (N,) of images by one clock of the camera, nanoseconds, increasing.

    They are absent if an image of any topic has no such time, or the clocks differ.
    """
    clocks: set[str] = set()
    stamps: dict[str, Index] = {}
    for topic in topics:
        found = _stamps(messages, topic, clocks)
        if found is None or len(clocks) != 1:
            return {}
        stamps[topic] = found
    return stamps


def _stamps(messages: Messages, topic: str, clocks: set[str]) -> Index | None:
    """Return the times (N,) of a topic, and add its clocks; None if an image has none."""
    sensor, _, _ = topic.partition("/image/data")
    metadata = f"{sensor}/image/metadata"
    known = messages.topics.get(metadata)
    count = len(messages.storage.times(topic))
    if known is None or known.kind != _STRING or len(messages.storage.times(metadata)) != count:
        return None
    stamps = np.zeros(count, dtype=np.int64)
    for index in range(count):
        try:
            text = str(messages.decode(metadata, index).data)
        except DamagedFrameError:
            return None
        time, clock = _TIME.search(text), _CLOCK.search(text)
        if time is None or clock is None:
            return None
        stamps[index] = round(float(time[1]) * 1e6)
        clocks.add(clock[1])
    return stamps if np.all(np.diff(stamps) > 0) else None
