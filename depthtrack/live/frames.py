"""Frames of a live source: a sensor, or a recording that is played like one."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Protocol

from numpy.typing import NDArray

from depthtrack.geometry.camera import Camera
from depthtrack.types import Image


@dataclass(frozen=True)
class LiveFrame:
    """One frame as a source delivers it.

    number: counts the frames of the source; gaps are frames that it dropped.
    timestamp: of the image, seconds on the source's clock.
    depth: (h, w) floats in metres, or uint16 in units of the camera's depth scale; 0 = none.
    colour: (h, w, 3) uint8 RGB registered to the depth, or None.
    arrival: when the frame was ready for tracking, seconds on the clock of the loop.
    """

    number: int
    timestamp: float
    depth: NDArray[Any]
    colour: Image | None
    arrival: float


class LiveSource(Protocol):
    """A source of frames; its iteration waits for each."""

    @property
    def name(self) -> str: ...

    @property
    def camera(self) -> Camera: ...

    def __iter__(self) -> Iterator[LiveFrame]: ...

    def close(self) -> None: ...
