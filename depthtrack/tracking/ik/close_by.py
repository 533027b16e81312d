"""Another pose close to one that explains little: many starts, each with its own fingers, by fitting."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthtrack.hand.synergies import Synergies
from depthtrack.rendering.scorer import Scorer
from depthtrack.tracking.ik.fit import Fitter
from depthtrack.tracking.ik.hierarchy import Stage, by_energy, descend
from depthtrack.tracking.looking_again import close_by

Array = NDArray[np.float64]


class LookAgain(NamedTuple):
    """When and how widely: at every so many-th frame (0: never) and where the track would be lost, `hypotheses` are
    looked at, which go through `stages`.

    The best is taken if its energy is less than the share `close_by` of what it was; one from anywhere else, less than
    the share `elsewhere`. In every frame, one that differs by a single finger is, if less than the share `one_finger`
    (0: never).
    """

    every: int = 5
    hypotheses: int = 3000
    stages: tuple[Stage, ...] = (Stage(48, None, 3), Stage(16, None, 4), Stage(6, None, 8), Stage(2, None, 12))
    close_by: float = 0.9
    elsewhere: float = 0.75
    one_finger: float = 0.98


def look_close_by(
    fitter: Fitter,
    scorer: Scorer,
    pose: Array,
    synergies: Synergies,
    options: LookAgain,
    generator: np.random.Generator,
) -> tuple[Array, float]:
    """The best pose (27,) found close to `pose` (27,), and its energy."""
    poses = by_energy(scorer, close_by(pose, generator, options.hypotheses))[0]
    poses, energies = descend(fitter, scorer, poses[: options.stages[0].keep], synergies, options.stages)
    return poses[0], float(energies[0])
