"""Frames that are read several times, and decoded once."""

from collections.abc import Iterable, Iterator
from itertools import groupby

from depthtrack.recording.sequence import Frame, Sequence

_MOST = 384 << 20
"""Bytes of images that are kept at most: 170 frames of 640x480 with colour."""


class KeptFrames:
    """The frames of a recording; the first ones that are read are kept.

    most: bytes of images to keep.
    """

    def __init__(self, sequence: Sequence, most: int = _MOST) -> None:
        self._sequence, self._room, self._kept = sequence, most, dict[int, Frame]()

    def frames(self, indices: Iterable[int]) -> Iterator[Frame]:
        """Yield frames as `Sequence.frames` does."""
        damaged = {each.index for each in self._sequence.damaged}
        readable = (index for index in indices if index not in damaged)
        for is_kept, group in groupby(readable, self._kept.__contains__):
            if is_kept:
                yield from map(self._kept.__getitem__, group)
            else:
                yield from self._read(group)

    def _read(self, indices: Iterable[int]) -> Iterator[Frame]:
        for frame in self._sequence.frames(indices):
            size = frame.depth.nbytes + (0 if frame.colour is None else frame.colour.nbytes)
            if size <= self._room:
                self._room -= size
                self._kept[frame.index] = frame
            yield frame
