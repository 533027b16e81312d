"""Markers by principal components of trajectories (Wheatland, Joerg and Zordan 2013)."""

import numpy as np

from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import make_pose
from depthtrack.markers.layout.candidates import Candidates
from depthtrack.types import Array, Index

_SHARE = 0.95
"""Share of the variance of the components that count."""


def wheatland_layout(candidates: Candidates, base: Index, postures: Array, count: int) -> Index:
    """Return the `count` candidates of a base set that influence the principal components most.

    base: (B,) candidates, the full marker set.
    postures: (T, 20) of the motion, rad; the trajectories are those in the frame of the palm.

    The influence of a marker is the sum of its loadings, weighted by the variances.
    """
    model = HandModel(candidates.hand)
    poses = make_pose(np.zeros(3), [1.0, 0, 0, 0], postures)
    points = model.transform_points(poses, candidates.bodies[base], candidates.offsets[base])
    X = points.reshape(len(postures), -1)
    _, singular, Vt = np.linalg.svd(X - X.mean(axis=0), full_matrices=False)
    variances = singular**2
    kept = int(np.searchsorted(np.cumsum(variances) / variances.sum(), _SHARE)) + 1
    loadings = np.abs(Vt[:kept]).reshape(kept, len(base), 3).sum(axis=2)
    influence = variances[:kept] @ loadings
    return np.asarray(base[np.argsort(-influence, kind="stable")[:count]])


def random_base(candidates: Candidates, each: int, generator: np.random.Generator) -> Index:
    """Return up to `each` random candidates of each body, as the paper's random subsets leave."""
    groups = candidates.by_body()
    return np.concatenate([generator.permutation(group)[:each] for group in groups])
