"""Kept frames are those of the recording, read once as far as they fit into memory."""

from collections.abc import Iterable, Iterator
from typing import Any, cast

import numpy as np
import pytest

from depthtrack.recording.kept_frames import KeptFrames
from depthtrack.recording.sequence import DamagedFrame, Frame, Sequence

SIZE = 10 * 20 * 4
"""Bytes of a frame."""


class Source:
    """A recording that lists the frames that it reads, and skips a damaged one."""

    def __init__(self) -> None:
        self.read = list[int]()
        self.damaged = list[DamagedFrame]()

    def frames(self, indices: Iterable[int]) -> Iterator[Frame]:
        for index in indices:
            if index == 4:
                self.damaged = [DamagedFrame(4, 0.4, "damaged")]
                continue
            self.read.append(index)
            yield Frame(index, 0.1 * index, np.full((10, 20), index, np.float32), None, cast(Any, None))


@pytest.mark.parametrize("room", [0, 1, 3, 100])
def test_frames_are_those_of_the_recording(room: int) -> None:
    source = Source()
    kept = KeptFrames(cast(Sequence, source), room * SIZE)
    for indices in ([0, 5], range(8), range(8), [7, 4, 2]):
        found = list(kept.frames(indices))
        assert [frame.index for frame in found] == [index for index in indices if index != 4]
        assert all((frame.depth == frame.index).all() for frame in found)
    expected = {0: 2 + 7 + 7 + 2, 1: 2 + 6 + 6 + 2, 3: 2 + 5 + 4 + 2, 100: 7}
    assert len(source.read) == expected[room]


def test_an_iteration_that_ends_early_keeps_what_it_read() -> None:
    source = Source()
    kept = KeptFrames(cast(Sequence, source))
    next(kept.frames(range(8)))
    list(kept.frames(range(2)))
    assert source.read == [0, 1]
