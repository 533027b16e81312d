"""What the compiled objectives of marker layouts read, made once for a set of key-frames."""

import numpy as np

from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import make_pose
from depthtrack.hand.skin.mesh import Skin
from depthtrack.hand.synergies import Synergies
from depthtrack.markers.layout.candidates import Candidates
from depthtrack.markers.layout.conditioning import Conditioning
from depthtrack.markers.layout.options import QualityOptions
from depthtrack.markers.layout.placement import Placement
from depthtrack.markers.layout.posterior import Posterior
from depthtrack.solver.prior import Prior
from depthtrack.types import Array

_FREE = 1.0
"""Standard deviation of the global pose before the first marker, metres and radians."""


def placement_of(candidates: Candidates, postures: Array, options: QualityOptions) -> Placement:
    """Return the distances over all key-frames (F, 20), rad."""
    model = HandModel(candidates.hand)
    points = model.transform_points(_poses(postures), candidates.bodies, candidates.offsets)
    flat = np.moveaxis(points, 1, 0)
    squares = np.stack([np.min(np.sum((flat - one) ** 2, axis=-1), axis=1) for one in flat])
    # The length L of the flat hand from the wrist to the farthest fingertip.
    endpoints = model.endpoints(_poses(np.zeros(20)))
    length = float(np.linalg.norm(endpoints - candidates.hand.wrist, axis=-1).max())
    paper = options.objective == "condition"
    return Placement(
        squares=squares / length**2,
        hidden=np.zeros(len(candidates)),
        length=length,
        distance_weight=options.condition.distance_weight
        if paper
        else 1000 * length * options.expected.distance_weight,
        enough=0.0 if paper else options.expected.apart / length,
        occlusion_weight=options.condition.occlusion_weight if paper else 0.0,
    )


def conditioning_of(
    candidates: Candidates, postures: Array, synergies: Synergies, options: QualityOptions
) -> Conditioning:
    """Return the products of the vertex Jacobians in key-frames (F, 20), rad."""
    model, poses = HandModel(candidates.hand), _poses(postures)
    J = _jacobian(model, poses, candidates)
    # The hand turns about the anchor at the wrist, which keeps its place.
    wrist = model.point_jacobian(poses, [0], model.wrist(poses)[:, None])
    turned = J[..., 3:6] - wrist[..., 3:6]
    J_pc = np.concatenate([turned, J[..., 6:] @ synergies.components], axis=-1)
    return Conditioning.of(J_pc, options.condition.condition_weight, options.anchored)


def posterior_of(
    candidates: Candidates, postures: Array, synergies: Synergies, options: QualityOptions, noise: Array
) -> Posterior:
    """Return Jacobians, prior and points of the hand in key-frames (F, 20), rad.

    synergies: of all components.
    noise: (V,) standard deviation of a coordinate of each candidate, metres.

    The points of the hand are the vertices of its skin, or the candidates if they are the markers of a model.
    """
    model, poses = HandModel(candidates.hand), _poses(postures)
    J = _jacobian(model, poses, candidates)
    fingers = np.where(candidates.bodies > 0, (candidates.bodies - 1) // 3, 0)
    columns = np.concatenate(
        [np.tile(np.arange(6), (len(fingers), 1)), 6 + 4 * fingers[:, None] + np.arange(4)], axis=1
    )
    prior = np.eye(26) / _FREE**2
    prior[6:, 6:] = Prior.from_synergies(synergies, 1.0, options.expected.beyond).precision
    whole = np.tile(prior, (len(postures), 1, 1))
    if options.anchored:
        wrist = model.point_jacobian(poses, [0], model.wrist(poses)[:, None])[:, 0]
        whole += np.einsum("fci,fcj->fij", wrist, wrist) / options.expected.residual**2
    return Posterior(
        jacobians=np.ascontiguousarray(np.take_along_axis(J, columns[None, :, None], axis=-1)),
        fingers=fingers,
        precision=1 / noise**2,
        prior=whole,
        spread=1e6 * _spread(candidates, model, poses, J),
    )


def _spread(candidates: Candidates, model: HandModel, poses: Array, J: Array) -> Array:
    """Return the mean (F, 26, 26) of J^T J over the points of the hand."""
    if not candidates.places:
        return np.einsum("fvci,fvcj->fij", J, J) / len(candidates)
    skin = Skin.of(candidates.hand)
    bodies, found = skin.weights.argmax(axis=1), []
    for pose in poses:
        at = model.point_jacobian(pose, bodies, skin.at(pose)).reshape(-1, 26)
        found.append(at.T @ at / len(bodies))
    return np.stack(found)


def _jacobian(model: HandModel, poses: Array, candidates: Candidates) -> Array:
    points = model.transform_points(poses, candidates.bodies, candidates.offsets)
    return model.point_jacobian(poses, candidates.bodies, points)


def _poses(postures: Array) -> Array:
    return make_pose(np.zeros(3), [1.0, 0, 0, 0], postures)
