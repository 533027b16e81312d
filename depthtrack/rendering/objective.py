"""The objective of Oikonomidis et al. 2011, Eq. (1) and (2), evaluated plainly in float64."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.hand.common_postures import add_posture_costs, common_postures
from depthtrack.hand.pose import ANGLES
from depthtrack.rendering.options import Objective
from depthtrack.types import Array, Mask


@dataclass(frozen=True)
class Terms:
    """Energies of Eq. (1) and their terms.

    energy: (B,) of Eq. (1), and the term of postures.
    depth: (B,) first term of Eq. (2), in `Objective.depth_unit`.
    silhouette: (B,) second term of Eq. (2) before lambda, 0 to 1.
    kinematic: (B,) kc of Eq. (1) before lambda_k, radians.
    """

    energy: Array
    depth: Array
    silhouette: Array
    kinematic: Array

    @property
    def agreement(self) -> Array:
        """Agreement (B,) of the rendered and the observed silhouette, 0 to 1, used to trust a pose."""
        return 1 - self.silhouette

    @classmethod
    def of_sums(
        cls, objective: Objective, poses: ArrayLike, clamped: Array, matched_silhouette: Array, union: Array
    ) -> "Terms":
        """Return the terms of poses (B, 27) from their sums of Eq. (2).

        clamped: (B,) sum of min(|o_d - r_d|, d_M), metres.
        matched_silhouette: (B,) pixels of o_s and r_m.
        union: (B,) pixels of o_s or r_m.
        """
        depth = clamped / objective.depth_unit / (union + objective.epsilon)
        silhouette = silhouette_disagreement(matched_silhouette, union)
        kinematic = finger_crossing(poses)
        energy = np.asarray(objective.combine(depth, silhouette, kinematic), dtype=np.float64)
        add_posture_terms(objective, poses, energy)
        return cls(energy, depth, silhouette, kinematic)


def add_posture_terms(objective: Objective, poses: ArrayLike, energies: Array) -> None:
    """Add the term of postures of poses (B, 27) to their energies (B,) of Eq. (1)."""
    if objective.posture_weight > 0:
        batch = np.ascontiguousarray(poses, dtype=np.float64)
        add_posture_costs(batch, *common_postures(), objective.posture_weight, energies)


def silhouette_disagreement(matched: Array, union: Array) -> Array:
    """Return the silhouette term (B,) of Eq. (2), 0 to 1; 1 if neither hand is visible."""
    total = matched + union
    return 1 - np.divide(2 * matched, total, out=np.zeros_like(total), where=total > 0)


def finger_crossing(poses: ArrayLike) -> Array:
    """Return kc (...,) of Eq. (1): the angle by which adjacent fingers cross, radians.

    poses: (..., 27) metres, quaternion, radians. The thumb is excluded.
    """
    abduction = np.asarray(poses, dtype=np.float64)[..., ANGLES][..., 4::4]
    phi = abduction[..., :-1] - abduction[..., 1:]
    return -np.minimum(phi, 0).sum(axis=-1)


def evaluate(
    objective: Objective, silhouette: Mask, observed: ArrayLike, rendered: ArrayLike, before: Mask | None = None
) -> tuple[float, float, float]:
    """Return the three sums of Eq. (2) for one rendered depth map, as in `Terms.of_sums`.

    silhouette: (h, w) o_s.
    observed: (h, w) metres, 0 = no reading.
    rendered: (h, w) metres, 0 = nothing drawn.
    before: (h, w) true where a pixel is drawn before or inside an occluder; None for no occluder.

    A drawn pixel is matched (r_m) if its depth lies within d_m of the observation, or if the observation is missing.
    Absent depth counts as 0 in the difference, so a pixel that only one map holds costs the full clamp.
    A pixel drawn before or inside an occluder counts `Objective.before_cost` times more, as outside the silhouette.
    """
    o, r = np.asarray(observed, dtype=np.float64), np.asarray(rendered, dtype=np.float64)
    difference = np.abs(o - r)
    matched = (r > 0) & ((difference < objective.match_depth) | (o == 0))
    clamped, union = np.minimum(difference, objective.clamp_depth), (silhouette | matched).astype(np.float64)
    if before is not None:
        clamped = clamped + objective.before_cost * objective.clamp_depth * before
        union = union + objective.before_cost * (before & ~silhouette)
    return float(clamped.sum()), float(np.sum(silhouette & matched)), float(union.sum())
