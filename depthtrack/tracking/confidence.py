"""Confidence of an estimate, and the visibility of its fingers.

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
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.target import Target
from depthtrack.rendering.visibility import points_in_view
from depthtrack.types import Array, Depth, Mask

CLIPPED = 0.04
"""Metres: depth difference at which a pixel disagrees completely, d_M of Oikonomidis et al. 2011, Eq. (2)."""
THICK = 0.006
"""Metres: silhouette parts that are thinner are errors of the outline."""
LONGEST_TRACK = 2.0
"""Seconds after a start from which on a track counts as old."""


class Evidence(NamedTuple):
    """Figures of an estimate that its confidence depends on.

    energy: logarithm of E of Oikonomidis et al. 2011, Eq. (1), as a share of a completely wrong pixel's.
    energy_ratio: logarithm of its ratio to the median energy of the track.
    depth_difference: logarithm of the mean difference of rendered and observed depth, clipped, mm.
    unexplained, in_vain: shares of the observed silhouette that the hand does not cover, and of the hand's that nothing
        was observed in.
    thick_unexplained, thick_in_vain: the same without parts thinner than `THICK`.
    visible: share of the bones' points that are visible.
    least_visible: that of the finger that is hidden most.
    area: observed area, in areas of the palm.
    pixels: logarithm of the number of observed pixels.
    age: time since the start of the track, s, at most `LONGEST_TRACK`.
    """

    energy: float
    energy_ratio: float
    depth_difference: float
    unexplained: float
    in_vain: float
    thick_unexplained: float
    thick_in_vain: float
    visible: float
    least_visible: float
    area: float
    pixels: float
    age: float


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


def evidence_of(
    pose: Array,
    rendered: Depth,
    target: Target,
    hand: HandShape,
    visibility: Array,
    energy: float,
    energy_ratio: float,
    age: float,
) -> Evidence:
    """Return the evidence of a pose (27,).

    rendered: (h, w) depth of the posed hand without what an occluder hides, metres.
    visibility: (5,) of the fingers.
    energy: in multiples of `Objective.clamp`.
    """
    unexplained, in_vain = (np.zeros(rendered.shape, dtype=np.bool_) for _ in range(2))
    counts = compare_images(rendered, target.depth, target.silhouette, unexplained, in_vain)
    observed, covered, missed, vain, compared, difference = counts
    pixel, palm = float(pose[2]) / target.camera.fx, hand.palm_breadth * hand.palm_length * hand.scale**2
    seen, shown = max(observed, 1), max(covered, 1)
    mean_difference = difference / compared if compared else CLIPPED
    return Evidence(
        energy=math.log(max(energy, 1e-3)),
        energy_ratio=energy_ratio,
        depth_difference=math.log(1e3 * max(mean_difference, 1e-4)),
        unexplained=missed / seen,
        in_vain=vain / shown,
        thick_unexplained=_thick(unexplained, pixel) / seen,
        thick_in_vain=_thick(in_vain, pixel) / shown,
        visible=float(visibility.mean()),
        least_visible=float(visibility.min()),
        area=seen * pixel**2 / palm,
        pixels=math.log(seen),
        age=min(age, LONGEST_TRACK),
    )


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


def finger_visibility(model: HandModel, pose: Array, rendered: Depth, target: Target) -> Array:
    """Return the visible share (5,) of the points along each finger's bones.

    Points behind the hand's own surface or behind the target's occluder are hidden.

    pose: (27,).
    rendered: (h, w) depth of the posed hand, metres; 0 for none.
    """
    ends = model.endpoints(pose).reshape(5, 4, 3)
    points = np.concatenate([ends[:, 1:], (ends[:, 1:] + ends[:, :-1]) / 2], axis=1)
    visible = points_in_view(points, rendered, target.camera)
    if target.occluder is not None:
        # Bones lie inside the fingers: none is behind an object that does not hide its finger.
        visible &= points_in_view(points, target.occluder, target.camera, behind=0.0)
    return np.asarray(visible.mean(axis=1))
