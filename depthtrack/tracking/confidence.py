"""Confidence of an estimate.

The confidence is the probability that the largest joint error is below 20 mm, apart from constant offsets of the
joints. Such offsets come from another skeleton or a wrong calibration. It is a logistic function of a few figures of
the frame. `tools/fit_confidence.py` fits it on the tuning seeds of the cross-model benchmark: no recording of a
reported figure takes part.
"""

import math
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import NamedTuple

import cv2
import numpy as np

from depthtrack.rendering.target import Target
from depthtrack.strict_data import parse_json
from depthtrack.tracking.spread import BonesInView
from depthtrack.types import Array, Depth

THICK = 0.006
"""Metres: silhouette parts that are thinner are errors of the outline."""


class Evidence(NamedTuple):
    """Figures of an estimate that its confidence depends on.

    energy: logarithm of E of Oikonomidis et al. 2011, Eq. (1), as a share of a completely wrong pixel's.
    unexplained: share of the observed silhouette that the hand does not cover. Parts thinner than `THICK` do not count.
    spread: logarithm of the largest spread of a keypoint, mm.
    posture: distance of the finger angles from common postures, in standard deviations.
    """

    energy: float
    unexplained: float
    spread: float
    posture: float


@dataclass(frozen=True)
class ConfidenceModel:
    """Logistic function of the evidence: sigmoid(bias + weights . evidence)."""

    weights: tuple[float, ...]
    bias: float

    def __call__(self, evidence: Evidence) -> float:
        """Return the probability that the largest joint error is below 20 mm."""
        return float(1 / (1 + np.exp(-np.clip(self.bias + np.dot(self.weights, evidence), -30, 30))))


@cache
def fitted_model() -> ConfidenceModel:
    """Return the fitted model, which `confidence.json` holds."""
    fields = parse_json(files("depthtrack.tracking").joinpath("confidence.json").read_text())
    weights = tuple(float(fields["weights"][name]) for name in Evidence._fields)
    return ConfidenceModel(weights, float(fields["bias"]))


def evidence_of(pose: Array, rendered: Depth, target: Target, bones: BonesInView, energy: float) -> Evidence:
    """Return the evidence of a pose (27,).

    rendered: (h, w) depth of the posed hand, metres; what hides it lies beside the silhouette.
    energy: in multiples of `Objective.clamp`.
    """
    return Evidence(
        energy=math.log(max(energy, 1e-3)),
        unexplained=unexplained_share(rendered, target, float(pose[2])),
        spread=math.log(1e3 * bones.widest),
        posture=bones.posture,
    )


def unexplained_share(rendered: Depth, target: Target, distance: float) -> float:
    """Return the share of the observed silhouette in thick parts that the hand does not cover.

    rendered: (h, w) depth of the posed hand, metres.
    distance: of the hand from the camera, metres.
    """
    side = max(1, round(THICK * target.camera.fx / distance))
    parts = (target.silhouette & (rendered == 0)).view(np.uint8)
    thick = cv2.erode(parts, np.ones((side, side), np.uint8)).view(np.bool_)
    return int(np.count_nonzero(thick)) / max(int(np.count_nonzero(target.silhouette)), 1)
