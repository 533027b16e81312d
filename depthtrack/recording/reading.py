"""Choices of the user about how a recording is read, beside its camera."""

from dataclasses import dataclass

from depthtrack.options import option


@dataclass(frozen=True)
class ReadingOptions:
    """How a recording is read. A format ignores the options that do not concern it."""

    depth_topic: str | None = option(None, "Topic of the depth images in a bag (default: the one found by its type)")
    colour_topic: str | None = option(None, "Topic of the colour images in a bag (default: the one found by its type)")
