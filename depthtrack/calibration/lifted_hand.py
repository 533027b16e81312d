"""Side and size of a hand from 2D keypoints and the depth images of a recording.

The palm states the size: its keypoints are seldom hidden, and its bones do not move against each other. Phalanges
keep the average hand's proportions, since noise of a few pixels is a fifth of a phalanx.
"""

from dataclasses import dataclass
from typing import get_args

import numpy as np

from depthtrack.calibration.keypoint_calibration import shape_from_keypoints
from depthtrack.errors import InputError
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape, Side
from depthtrack.hand.synergies import load_synergies
from depthtrack.recording.keypoints import KeypointFile
from depthtrack.recording.sequence import Frame, Sequence
from depthtrack.solver.keypoints import IN_PALM
from depthtrack.solver.lifting import Lifter
from depthtrack.solver.options import LiftOptions
from depthtrack.types import Array

_SAMPLE = 60
"""Frames that are lifted."""
_ROUNDS = 3
"""Lifts of the sample, each with the sizes of the one before."""


@dataclass(frozen=True)
class LiftedHand:
    """A hand measured on keypoints.

    costs: mean robust cost of the keypoints of each side that was tried, 0 to 1.
    """

    hand: HandShape
    costs: dict[Side, float]


def measure_lifted_hand(
    sequence: Sequence, keypoints: KeypointFile, side: Side | None = None, options: LiftOptions | None = None
) -> LiftedHand:
    """Return the average hand scaled to the keypoints of a recording.

    side: of the hand; the one with the lower cost if None.

    Raises:
        InputError: if no frame has enough keypoints with a depth.
    """
    rows = keypoints.rows(sequence.timestamps)
    with_row = np.flatnonzero(rows >= 0)
    if not len(with_row):
        raise InputError(
            f"no row of the keypoints belongs to a frame of {sequence.name}: their times must be those of its frames"
        )
    chosen = with_row[np.linspace(0, len(with_row) - 1, min(_SAMPLE, len(with_row))).astype(int)]
    frames = list(keypoints.attach(sequence.frames(map(int, chosen)), sequence.timestamps))
    costs: dict[Side, float] = {}
    for each in get_args(Side) if side is None else (side,):
        costs[each] = _lifted(frames, HandShape(side=each), options)[1]
    hand = HandShape(side=min(costs, key=lambda each: costs[each]))
    for _ in range(_ROUNDS):
        points, _ = _lifted(frames, hand, options)
        if not len(points):
            raise InputError(f"no frame of {sequence.name} has enough keypoints on readings: hand sizes need them")
        source = f"size of the keypoints of {sequence.name}"
        hand = HandShape(side=hand.side, scale=_palm_ratio(points, hand.side), source=source)
    return LiftedHand(hand, costs)


def _lifted(frames: list[Frame], hand: HandShape, options: LiftOptions | None) -> tuple[Array, float]:
    """Return the measured keypoints (N, 21, 3) of lifted frames, and the mean cost.

    The cost is 1 without any.
    """
    lifter = Lifter(HandModel(hand), load_synergies(), options or LiftOptions())
    found = [lifter.lift(frame.keypoints, frame.camera, frame.depth) for frame in frames if frame.keypoints is not None]
    lifted = [each for each in found if each is not None]
    points = np.array([each.points for each in lifted]).reshape(-1, 21, 3)
    return points, float(np.mean([each.cost for each in lifted])) if lifted else 1.0


def _palm_ratio(points: Array, side: Side) -> float:
    """Return the size of the palm of measured keypoints (N, 21, 3), relative to the average.

    Raises:
        InputError: if no frame shows enough of the palm.
    """
    spreads = []
    for shape in (shape_from_keypoints(points, side), HandShape()):
        palm = np.concatenate([shape.wrist[None], shape.bases * shape.scale])[: len(IN_PALM)]
        spreads.append(float(np.linalg.norm(palm - palm.mean(axis=0))))
    return float(np.clip(spreads[0] / spreads[1], 0.5, 1.6))
