"""Choice of the topics with depth and colour among those of a bag."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.recording.bags.images import COMPRESSED_IMAGE, IMAGE, encoding_of, is_colour, is_depth
from depthtrack.recording.bags.messages import Messages
from depthtrack.recording.reading import ReadingOptions

_OTHER_IMAGES = re.compile(r"infra|confidence|amplitude|(^|[/_])ir([/_\d]|$)|/frameType_1$", re.IGNORECASE)
"""Topics of images that are neither depth nor colour, whatever their encoding."""
_DEPTH_NAME = re.compile(r"depth|(^|/)frameType_3$", re.IGNORECASE)
_COLOUR_NAME = re.compile(r"colou?r|rgb|(^|/)frameType_2$", re.IGNORECASE)


@dataclass(frozen=True)
class Choice:
    """Topics of depth and colour; `colour` is None if there is none.

    others: further topics with depth.
    """

    depth: str
    colour: str | None
    others: tuple[str, ...] = ()


def choose_topics(messages: Messages, reading: ReadingOptions) -> Choice:
    """Return the topics to read: those of the options, else those found by type.

    Depth that the camera's program aligned with the colour is preferred, then images that are not compressed.

    Raises:
        InputError: if a given topic has no images, or no topic has depth.
    """
    images = _images(messages)
    where = messages.storage.path
    found = [name for name in images if is_depth(images[name]) and not _OTHER_IMAGES.search(name)]
    found.sort(key=lambda name: (not _DEPTH_NAME.search(name), "aligned" not in name, _is_packed(images[name]), name))
    if reading.depth_topic is None and not found:
        listed = ", ".join(f"{name} ({encoding_of(each)[:30]})" for name, each in images.items()) or "no images"
        hint = (
            ": depth that was turned into a picture cannot be read back, so record the original depth topic"
            if any(_DEPTH_NAME.search(name) for name in images)
            else ""
        )
        raise InputError(f"{where} must have a topic with depth images (16UC1 or 32FC1), found {listed:.400}{hint}")
    depth = _given(reading.depth_topic, "--depth-topic", images, is_depth, messages) or found[0]
    colour = _given(reading.colour_topic, "--colour-topic", images, is_colour, messages)
    if colour is None:
        candidates = [
            name
            for name in images
            if is_colour(images[name])
            and not _OTHER_IMAGES.search(name)
            and (_COLOUR_NAME.search(name) or not _DEPTH_NAME.search(name))
        ]
        candidates.sort(key=lambda name: (not _COLOUR_NAME.search(name), _is_packed(images[name]), name))
        colour = candidates[0] if candidates else None
    others = () if reading.depth_topic is not None else tuple(name for name in found if name != depth)
    return Choice(depth, colour, others)


def _images(messages: Messages) -> dict[str, Any]:
    """Return a message of each topic with images."""
    found = {}
    for name, topic in sorted(messages.topics.items()):
        if topic.kind in (IMAGE, COMPRESSED_IMAGE):
            try:
                found[name] = messages.first(name)
            except DamagedFrameError:
                continue
    return found


def _given(
    name: str | None, option: str, images: Mapping[str, Any], fits: Callable[[Any], bool], messages: Messages
) -> str | None:
    """Return a topic that the user named, None for none. Raises InputError."""
    if name is None:
        return None
    if name not in images:
        listed = ", ".join(images) or "none"
        raise InputError(f"{option} must be a topic with images of {messages.storage.path}: {listed:.400}")
    if not fits(images[name]):
        raise InputError(
            f"{option} {name} has images of the encoding {encoding_of(images[name])[:40]!r}, which cannot be used:"
            " depth must be 16UC1 or 32FC1, and colour rgb8, bgr8 or JPEG"
        )
    return name


def _is_packed(message: Any) -> bool:
    return not hasattr(message, "encoding")
