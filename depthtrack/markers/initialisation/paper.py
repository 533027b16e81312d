"""Initialisation as in Maycock et al. 2015, Sec. III-A and Fig. 2.

Automatic clustering, every model against every cluster, alignment and scaling, rigid ICP, optimal assignment, inverse
kinematics, and the best match by Eq. (2). The hand must be in the calibration posture: flat, with spread fingers.
"""

from dataclasses import dataclass

import numpy as np

from depthtrack.geometry.rotations import quaternion_from_matrix
from depthtrack.hand.pose import make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.markers.initialisation.alignment import (
    box_scale,
    canonical_form,
    mean_distance,
    principal_alignments,
    rigid_icp,
)
from depthtrack.markers.initialisation.assignment import assign_all
from depthtrack.markers.initialisation.clusters import euclidean_clusters
from depthtrack.markers.initialisation.options import PaperOptions
from depthtrack.markers.initialisation.started import StartedModel
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.solver.point_fit import fit_points
from depthtrack.types import Array, Index

_FEWEST_POINTS = 3


@dataclass(frozen=True, eq=False)
class _Match:
    """A model fitted to a cluster.

    points: (M,) point of each marker, -1 for none. distance: mean distance E of Eq. (2), metres. cost: of Eq. (2).
    """

    model: MarkerModel
    pose: Array
    points: Index
    distance: float
    cost: float


def initialise_as_paper(
    points: Array, models: tuple[MarkerModel, ...], options: PaperOptions | None = None
) -> tuple[StartedModel | None, ...]:
    """Return each model in the cluster that it matches best; None without a cluster.

    points: (K, 3) metres, capture frame, finite.
    """
    options = options or PaperOptions()
    clusters = [c for c in euclidean_clusters(points, options.cluster_distance) if len(c) >= _FEWEST_POINTS]
    matches = [[_match(model, points, cluster, options) for cluster in clusters] for model in models]
    if not clusters:
        return (None,) * len(models)
    costs = np.array([[match.cost for match in row] for row in matches])
    chosen = assign_all(costs)
    return tuple(
        None if c < 0 else _started(matches[k][c], points, np.delete(costs[k], c)) for k, c in enumerate(chosen)
    )


def _match(model: MarkerModel, points: Array, cluster: Index, options: PaperOptions) -> _Match:
    """Return the model aligned, scaled, assigned and fitted to a cluster."""
    target = points[cluster]
    angles = np.zeros(20) if model.is_rigid else POSTURES["open"]
    rest = make_pose(np.zeros(3), (1, 0, 0, 0), angles)
    goal = canonical_form(target)
    if not model.is_rigid:
        model = _scaled(model, box_scale(canonical_form(model.positions(rest)), goal, options.scale_limits))
    source = model.positions(rest)
    aligned = [
        rigid_icp(source, target, R, t, options.icp_iterations)
        for R, t in principal_alignments(canonical_form(source), goal)
    ]
    R, t = min(aligned, key=lambda transform: mean_distance(source @ transform[0].T + transform[1], target))
    pose, assigned = make_pose(t, quaternion_from_matrix(R), angles), np.full(len(source), -1)
    for _ in range(options.rounds):
        distances = np.linalg.norm(model.positions(pose)[:, None] - target, axis=-1)
        previous, assigned = assigned, assign_all(distances)
        if np.array_equal(previous, assigned):
            break
        pose = _fitted(model, target, assigned, pose)
    seen = assigned >= 0
    distance = float(np.linalg.norm(model.positions(pose)[seen] - target[assigned[seen]], axis=-1).mean())
    cost = distance * 1000 + options.count_weight * abs(len(target) - len(source))
    return _Match(model, pose, np.where(seen, cluster[assigned], -1), distance, cost)


def _scaled(model: MarkerModel, factor: float) -> MarkerModel:
    """Return the model stretched or contracted to the observed size."""
    assert model.hand is not None
    return model.with_(hand=model.hand.with_(scale=model.hand.scale * factor), offsets=model.offsets * factor)


def _fitted(model: MarkerModel, target: Array, assigned: Index, pose: Array) -> Array:
    """Return the pose of inverse kinematics, Eq. (4) to (6)."""
    targets = np.where((assigned >= 0)[:, None], target[assigned], np.nan)
    return fit_points(model.kinematics.chain, model.bodies, model.offsets, targets, start=pose).pose


def _started(match: _Match, points: Array, others: Array) -> StartedModel:
    seen = match.points >= 0
    e = match.model.positions(match.pose)[seen] - points[match.points[seen]]
    margin = float(others.min() - match.cost) if len(others) else 0.0
    residual = float(np.sqrt(np.square(e).sum(axis=-1).mean()))
    return StartedModel(match.model, match.pose, match.points, match.cost, residual, margin, 1.0 if margin > 0 else 0.5)
