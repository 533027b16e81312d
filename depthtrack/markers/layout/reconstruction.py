"""Poses of a hand from sparse markers (Schroeder et al. 2015, Sec. 3).

Inverse kinematics in the subspace of the synergies (Eq. 3 and 4), then a refinement of all angles.
"""

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from depthtrack.compilation import compiled
from depthtrack.errors import InputError
from depthtrack.hand.compiled_kinematics import Chain
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.pose import make_pose
from depthtrack.hand.synergies import Synergies
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.options import check_ranges, option
from depthtrack.solver.fixed_points import FixedPoints
from depthtrack.solver.gauss_newton import solve_each
from depthtrack.solver.normal_equations import NormalEquations
from depthtrack.solver.point_fit import PointFitOptions, aligned_poses
from depthtrack.solver.prior import Prior
from depthtrack.solver.problem import Problem, SolverOptions
from depthtrack.solver.subspace import FULL, PostureSubspace
from depthtrack.types import Array

Method = Literal["subspace", "prior", "plain"]
"""How angles without markers are found.

`subspace`: in the subspace, then all angles are refined without it (the paper). `prior`: the refinement prefers
postures that the synergies make likely. `plain`: all angles alone; those without markers keep their values.
"""


@dataclass(frozen=True)
class ReconstructionOptions:
    """Inverse kinematics from sparse markers."""

    method: Method = option("prior", "Subspace and free refinement, subspace and refinement with a prior, or neither")
    components: int = option(6, "Synergies of the subspace, at most", least=1, most=20)
    iterations: int = option(
        10, "Gauss-Newton steps in each of both stages", source="Schroeder et al. 2015: 5 to 10", least=1, most=1000
    )
    damping: float = option(
        1e-5,
        "Damping D of each angle or synergy; a weak one lets angles swing that the markers hardly determine",
        unit="m^2/rad^2",
        source="Eq. (2)",
    )
    residual: float = option(
        0.0003,
        "Standard deviation of a coordinate of a marker, which the prior is weighed against",
        unit="m",
        least=1e-6,
    )
    beyond: float = option(
        0.035,
        "Standard deviation of each angle about the postures of the synergies, for the prior",
        unit="rad",
        least=1e-3,
    )

    def __post_init__(self) -> None:
        check_ranges(self)


class _Stage(NamedTuple):
    space: PostureSubspace
    prior: Prior


def reconstruct(
    model: MarkerModel,
    positions: Array,
    synergies: Synergies,
    options: ReconstructionOptions | None = None,
    anchors: Array | None = None,
) -> Array:
    """Return the poses (T, 27) of a hand whose markers were measured.

    positions: (T, M, 3) metres, NaN if not measured.
    synergies: their first components are the subspace, all of them the prior; `plain` starts from their mean.
    anchors: (T, 3) measured positions of the wrist, metres; None if there is no marker.

    Each frame starts at the last pose, and the first one at the best of several postures of the subspace.

    Raises:
        InputError: if the model is a rigid body, or the first frame has fewer than three points.
    """
    options = options or ReconstructionOptions()
    if model.hand is None:
        raise InputError(f"'{model.name}' is a rigid body: sparse markers are those of a hand")
    bodies, local = np.asarray(model.bodies), np.asarray(model.offsets)
    if anchors is not None:
        bodies, local = np.append(bodies, 0), np.concatenate([local, model.hand.wrist[None]])
        positions = np.concatenate([positions, anchors[:, None]], axis=1)
    seen = np.asarray(np.isfinite(positions).all(axis=-1))
    if seen[0].sum() < 3:
        raise InputError(f"the first frame must show three markers at least, found {seen[0].sum()}")
    targets, weights = np.where(seen[..., None], positions, 0.0), seen.astype(np.float64)
    points = FixedPoints.of(bodies, local, np.zeros((len(bodies), 3)))
    problems = tuple(
        Problem(Chain.of(model.hand), NormalEquations.empty(), points, stage.prior, stage.space)
        for stage in _stages(synergies, options)
    )
    solver = PointFitOptions(iterations=options.iterations, damping=options.damping).solver
    poses = np.empty((len(positions), 27))
    poses[0] = _first_pose(model, problems, solver, targets[0], weights[0])
    _follow(problems[0], problems[1], solver, targets, weights, poses)
    return poses


def _stages(synergies: Synergies, options: ReconstructionOptions) -> tuple[_Stage, _Stage]:
    """Return the spaces and priors of both stages; those of `plain` are equal."""
    free = _Stage(FULL, Prior.none())
    if options.method == "plain":
        return free, free
    within = PostureSubspace.of(synergies, min(options.components, len(synergies)))
    if options.method == "subspace":
        return _Stage(within, Prior.none()), free
    prior = Prior.from_synergies(synergies, options.residual**2, options.beyond)
    return _Stage(within, prior), _Stage(FULL, prior)


def _first_pose(
    model: MarkerModel, problems: tuple[Problem, ...], solver: SolverOptions, targets: Array, weights: Array
) -> Array:
    """Return the best fit (27,) of the first frame from several postures."""
    space, points = problems[0].space, problems[0].points
    starts = []
    for step in np.concatenate([np.zeros((1, len(space.lower))), np.diag(space.lower), np.diag(space.upper)]) / 2:
        angles = np.clip(space.angles(step), LOWER, UPPER)
        if space.full:
            angles = 0.5 * (LOWER + UPPER) * 0.5 + step
        rest = model.kinematics.transform_points(
            make_pose(np.zeros(3), [1.0, 0, 0, 0], angles), points.body, points.local
        )
        starts.append(aligned_poses(angles, rest, targets, weights))
    poses, energies = np.array(starts), np.empty(len(starts))
    for k in range(len(starts)):
        _follow(problems[0], problems[1], solver, targets[None], weights[None], poses[k : k + 1])
        solve_each(problems[1], solver, targets[None], weights[None], poses[k : k + 1], energies[k : k + 1])
    return np.asarray(poses[int(np.argmin(energies))])


@compiled(nogil=True)
def _follow(
    first: Problem, second: Problem, options: SolverOptions, targets: Array, weights: Array, poses: Array
) -> None:
    """Fit each frame from the pose before, in the first space and then in the second.

    targets: (T, N, 3); weights: (T, N). poses: (T, 27), the first one is the start.
    """
    energies, space = np.empty(1), first.space
    count = space.lower.shape[0]
    for t in range(poses.shape[0]):
        if t > 0:
            poses[t] = poses[t - 1]
        pose = poses[t]
        if not space.full:
            # The posture of the subspace nearest to the last one.
            before = pose[7:].copy()
            pose[7:] = space.mean
            for k in range(count):
                x = 0.0
                for j in range(20):
                    x += space.basis[j, k] * (before[j] - space.mean[j])
                x = min(max(x, space.lower[k]), space.upper[k])
                for j in range(20):
                    pose[7 + j] += x * space.basis[j, k]
        solve_each(first, options, targets[t : t + 1], weights[t : t + 1], poses[t : t + 1], energies)
        for j in range(20):
            pose[7 + j] = min(max(pose[7 + j], second.space.lower[j]), second.space.upper[j])
        solve_each(second, options, targets[t : t + 1], weights[t : t + 1], poses[t : t + 1], energies)
