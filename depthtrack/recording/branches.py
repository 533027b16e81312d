"""Branches: discrete alternatives to the tracked pose.

They are followed beside it until the evidence decides.

`branches.csv` of a run folder has a row for each branch of each frame, so that a resumed run goes on with them.
"""

import math
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np

from depthtrack.errors import InputError
from depthtrack.hand.pose import POSE_NAMES
from depthtrack.number_text import parse_number, parse_numbers, parse_whole_number
from depthtrack.recording.run_tables import read_table
from depthtrack.types import Array

BRANCH_COLUMNS = ("index", "begun", "frames", "evidence", *POSE_NAMES)
_LEAST_ENERGY = 1e-3
"""Energy that a ratio of energies is limited to."""


class Branch(NamedTuple):
    """Alternative to the tracked pose, such as the palm taken for the back of the hand.

    pose: (27,) in the last frame.
    begun: time of its first frame, s.
    frames: number of frames in which it was compared with the tracked pose.
    evidence: sum over them of the logarithm of the tracked pose's energy over its own.
    """

    pose: Array
    begun: float
    frames: int = 0
    evidence: float = 0.0

    def compared(self, pose: Array, energy: float, tracked: float) -> Self:
        """Return the branch with the evidence of the next frame.

        pose: (27,) that it was followed to, of this energy.
        tracked: energy of the tracked pose.
        """
        gain = math.log(max(tracked, _LEAST_ENERGY) / max(energy, _LEAST_ENERGY))
        return self._replace(pose=pose, frames=self.frames + 1, evidence=self.evidence + gain)

    @property
    def energy_ratio(self) -> float:
        """Mean energy as a multiple of the tracked pose's (geometric); 1 at first."""
        return math.exp(-self.evidence / self.frames) if self.frames else 1.0


def branch_rows(index: int, branches: Iterable[Branch]) -> list[list[str]]:
    """Return the cells of the branches of a frame."""
    return [
        [str(index), repr(each.begun), str(each.frames), repr(each.evidence), *(repr(float(x)) for x in each.pose)]
        for each in branches
    ]


def read_branches(path: Path) -> dict[int, tuple[Branch, ...]]:
    """Return the branches of each frame that has any.

    Earlier runs lack the file, and have none.

    Raises:
        InputError: if a row is malformed, or holds values that no tracker writes.
    """
    if not path.exists():
        return {}
    found: dict[int, tuple[Branch, ...]] = {}
    for number, (index, begun, frames, evidence, *pose) in enumerate(read_table(path, BRANCH_COLUMNS), start=2):
        try:
            branch = Branch(
                np.array(parse_numbers(pose)), parse_number(begun), parse_whole_number(frames), parse_number(evidence)
            )
            frame = parse_whole_number(index)
        except ValueError as error:
            raise InputError(f"{path}, line {number}: expected the numbers of a branch: {error!s:.120}") from error
        if not np.isfinite([branch.begun, branch.evidence, *branch.pose]).all() or branch.frames < 0:
            raise InputError(f"{path}, line {number}: the numbers of a branch must be finite")
        found[frame] = (*found.get(frame, ()), branch)
    return found
