"""Confidence of an estimate.

The confidence is the probability that the largest joint error is below 20 mm. It is a logistic function of a few
figures of the frame. `tools/fit_confidence.py` fits it on the tuning seeds of the cross-model benchmark: no recording
of a reported figure takes part.
"""

import json
import math
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import NamedTuple

import cv2
import numpy as np

from depthtrack.compilation import compiled
from depthtrack.rendering.target import Target
from depthtrack.tracking.spread import CLIPPED, BonesInView
from depthtrack.types import Array, Depth, Mask

THICK = 0.006
"""Metres: silhouette parts that are thinner are errors of the outline."""


class Evidence(NamedTuple):
    """Figures of an estimate that its confidence depends on.

    energy: logarithm of E of Oikonomidis et al. 2011, Eq. (1), as a share of a completely wrong pixel's.
    depth_difference: logarithm of the mean difference of rendered and observed depth, clipped, mm.
    finger_difference: the same for the finger that agrees least.
    in_vain: share of the hand's silhouette that nothing was observed in.
    thick_unexplained: share of the observed silhouette that the hand does not cover; parts thinner than `THICK` are not
        counted.
    largest_spread, usual_spread: logarithms of the largest and of the median spread of the fingers, mm.
    posture: distance of the finger angles from common postures, in standard deviations.
    pixels: logarithm of the number of observed pixels.
    """

    energy: float
    depth_difference: float
    finger_difference: float
    in_vain: float
    thick_unexplained: float
    largest_spread: float
    usual_spread: float
    posture: float
    pixels: float


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
    fields = json.loads(files("depthtrack.tracking").joinpath("confidence.json").read_text())
    weights = tuple(float(fields["weights"][name]) for name in Evidence._fields)
    return ConfidenceModel(weights, float(fields["bias"]))


def evidence_of(pose: Array, rendered: Depth, target: Target, bones: BonesInView, energy: float) -> Evidence:
    """Return the evidence of a pose (27,).

    rendered: (h, w) depth of the posed hand, metres.
    energy: in multiples of `Objective.clamp`.
    """
    unexplained, in_vain = (np.zeros(rendered.shape, dtype=np.bool_) for _ in range(2))
    counts = compare_images(rendered, target.depth, target.silhouette, unexplained, in_vain)
    observed, covered, _, vain, compared, difference = counts
    pixel, seen = float(pose[2]) / target.camera.fx, max(observed, 1)
    fingers = bones.spread[1:].reshape(5, 4).max(axis=1)
    return Evidence(
        energy=math.log(max(energy, 1e-3)),
        depth_difference=_logarithm(difference / compared if compared else CLIPPED),
        finger_difference=_logarithm(bones.differences.mean(axis=(1, 2)).max()),
        in_vain=vain / max(covered, 1),
        thick_unexplained=_thick(unexplained, pixel) / seen,
        largest_spread=_logarithm(fingers.max()),
        usual_spread=_logarithm(np.median(fingers)),
        posture=bones.posture,
        pixels=math.log(seen),
    )


def _logarithm(distance: float) -> float:
    """Return the logarithm of a distance in mm; of 0.1 mm if it is less."""
    return math.log(1e3 * max(float(distance), 1e-4))


@compiled(nogil=True)
def compare_images(
    rendered: Depth, depth: Depth, silhouette: Mask, unexplained: Mask, in_vain: Mask
) -> tuple[int, int, int, int, int, float]:
    """Write which pixels are unexplained or covered in vain; return sums over the image.

    rendered, depth: (h, w) metres, 0 for none.
    silhouette, unexplained, in_vain: (h, w).

    Returns:
        Numbers of observed, covered, unexplained and vainly covered pixels, of pixels with both depths, and the sum of
        their clipped differences, metres.
    """
    observed, covered, missed, vain, compared, difference = 0, 0, 0, 0, 0, 0.0
    for v in range(rendered.shape[0]):
        for u in range(rendered.shape[1]):
            there, here = silhouette[v, u], rendered[v, u] > 0
            observed, covered = observed + there, covered + here
            if there and not here:
                unexplained[v, u] = True
                missed += 1
            if here and not there:
                in_vain[v, u] = True
                vain += 1
            if here and depth[v, u] > 0:
                compared += 1
                difference += min(abs(float(rendered[v, u]) - float(depth[v, u])), CLIPPED)
    return observed, covered, missed, vain, compared, difference


def _thick(mask: Mask, pixel: float) -> int:
    """Return the number of pixels that are no outline; `pixel`: its side, metres."""
    side = max(1, round(THICK / pixel))
    return int(cv2.erode(mask.view(np.uint8), np.ones((side, side), np.uint8)).sum())
