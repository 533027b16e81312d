"""Lifting of 2D keypoints to a metric pose of the hand, with the depth image.

Each keypoint lies on its line of sight. The depth read there states how far, unless another part of the hand hides it.
A robust fit of the hand decides which readings agree, by iteratively reweighted least squares (Geman and McClure 1987)
with a scale that decreases from round to round:

    E = 1/2 sum_k c_k (w_k |(I - d_k d_k^T) x_k|^2 + a w'_k (d_k . x_k - r_k)^2) + prior

The confidence is c, and the robust weights are w and w'. The measured distance r is that of the skin, and half a finger
beyond it. The prior holds likely postures, and those of the last frame (see `prior`). Postures of several kinds are
starts; the least robust cost decides.
"""

from dataclasses import dataclass, replace

import numpy as np

from depthtrack.geometry.camera import Camera
from depthtrack.hand.compiled_kinematics import BodyPoses
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import ANGLES, make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.shape import HandShape
from depthtrack.hand.synergies import Synergies
from depthtrack.recording.sequence import ImageKeypoints
from depthtrack.solver.gauss_newton import solve
from depthtrack.solver.keypoints import IN_PALM, local_keypoints
from depthtrack.solver.normal_equations import NormalEquations, clear
from depthtrack.solver.options import LiftOptions
from depthtrack.solver.point_fit import PointFitOptions, aligned_poses
from depthtrack.solver.prior import Prior, prior_energy
from depthtrack.solver.problem import Problem, SolverState
from depthtrack.solver.reprojection import COUNT, LinesOfSight, depth_cost, mean_misfit
from depthtrack.solver.subspace import FULL
from depthtrack.types import Array, Depth

_STARTS = ("relaxed", "open", "fist", "point")
_FINGER_WEIGHT = 0.05
"""Weight of the keypoints outside the palm in the alignment of a start, against 1."""
_SOLVER = PointFitOptions(iterations=4, energy_tolerance=1e-3).solver


@dataclass(frozen=True)
class LiftedPose:
    """A pose lifted from keypoints.

    pose: (27,) within the limits.
    cost: mean robust cost of the keypoints' distances from their lines of sight, 0 to 1.
    points: (21, 3) keypoints at their measured distance, metres, camera frame; NaN if it was not measured or the pose
        contradicts it.
    """

    pose: Array
    cost: float
    points: Array


class Lifter:
    """Lifts keypoints to poses of one hand."""

    def __init__(self, model: HandModel, synergies: Synergies, options: LiftOptions) -> None:
        self.options, self._model, self._local = options, model, local_keypoints(model)
        self._likely = Prior.from_synergies(synergies, options.spread**2)
        self._half = half_thickness(model.shape)

    def lift(
        self, keypoints: ImageKeypoints, camera: Camera, depth: Depth, last: Array | None = None
    ) -> LiftedPose | None:
        """Return the pose with keypoints in the given pixels.

        None is returned if too few are known, or if no pose has them.

        depth: (h, w) metres of the hand, 0 = none, in the image of the camera.
        last: (27,) pose of the frame before; None without one.
        """
        keypoints = confident(keypoints, self.options.least_confidence)
        if np.count_nonzero(keypoints.confidence) < self.options.least_keypoints:
            return None
        reach = measured_reach(keypoints, camera, depth, self.options.window) + self._half
        if not np.isfinite(reach).any():
            return None
        # Farther readings are those of the background.
        reach[np.abs(reach - np.nanmedian(reach)) > self._model.shape.scale * self.options.farthest] = np.nan
        if not np.isfinite(reach).any():
            return None
        sight = LinesOfSight.of(keypoints, camera, self._local, reach)
        prior = self._likely if last is None else self._with_last(last)
        fitted = [self._fit(sight, start, prior) for start in self._starts(sight, last)]
        pose, bodies, cost = min(fitted, key=lambda each: each[2])
        if not np.isfinite(cost):
            return None
        _, along = sight.distances(bodies)
        points = np.where(np.abs(along)[:, None] < self.options.scale[1], reach[:, None] * sight.directions, np.nan)
        return LiftedPose(pose, mean_misfit(sight.misfits(bodies, self.options.scale[1])), points)

    def misfits(self, pose: Array, keypoints: ImageKeypoints, camera: Camera) -> Array:
        """Return the robust costs (21,), 0 to 1, of keypoints in a pose (27,); NaN if unknown."""
        sight = LinesOfSight.of(confident(keypoints, self.options.least_confidence), camera, self._local)
        return sight.misfits(BodyPoses.at(self._model.chain, pose), self.options.scale[1])

    def _with_last(self, last: Array) -> Prior:
        """Return the product of the prior of postures and one about the last angles."""
        pull = self.options.spread**2 / self.options.angle_motion**2
        precision = self._likely.precision + pull * np.eye(20)
        moment = self._likely.precision @ self._likely.mean + pull * last[ANGLES]
        return Prior(precision, np.asarray(np.linalg.solve(precision, moment), dtype=np.float64))

    def _starts(self, sight: LinesOfSight, last: Array | None) -> list[Array]:
        """Return poses (27,): several postures, aligned with the keypoints.

        A keypoint without a measured distance has the median one.
        """
        reach = np.where(np.isfinite(sight.reach), sight.reach, np.nanmedian(sight.reach))
        targets = reach[:, None] * sight.directions
        weights = np.full(COUNT, _FINGER_WEIGHT)
        weights[IN_PALM] = 1.0
        weights *= sight.confidence
        postures = [POSTURES[name] for name in _STARTS] + ([] if last is None else [last[ANGLES]])
        starts = [] if last is None else [last]
        for angles in postures:
            points = self._model.keypoints(make_pose(np.zeros(3), (1, 0, 0, 0), angles))
            starts.append(aligned_poses(angles, points, targets, weights))
        return starts

    def _fit(self, sight: LinesOfSight, start: Array, prior: Prior) -> tuple[Array, BodyPoses, float]:
        """Return the fitted pose (27,) from `start`, its bodies, and its robust cost, m^2."""
        options, model = self.options, self._model
        state, equations = SolverState.at(start, FULL), NormalEquations.empty()
        bodies, trace = BodyPoses.at(model.chain, state.pose), np.empty(_SOLVER.iterations + 1)
        problem = Problem(model.chain, equations, sight.block, prior, FULL)
        first, last = options.scale
        for k in range(options.rounds):
            scale = first * (last / first) ** (k / max(options.rounds - 1, 1))
            sight.reweigh(bodies, 1.0, scale, options.along_weight)
            clear(equations, bodies)
            solve(problem, _SOLVER, bodies, state, trace)
        # A ray has no end behind the camera.
        if bodies.T[:, 2, 3].min() <= 0:
            return state.pose, bodies, np.inf
        return state.pose, bodies, self._cost(sight, bodies) + prior_energy(state.pose, prior)

    def _cost(self, sight: LinesOfSight, bodies: BodyPoses) -> float:
        """Return the sum of robust costs, m^2; a distance that was not measured costs as an outlier."""
        scale, along_weight = self.options.scale[1], self.options.along_weight
        across, along = sight.distances(bodies)
        cost = scale**2 * (1 - 1 / (1 + across**2 / scale**2))
        return 0.5 * float(sight.confidence @ (cost + along_weight * depth_cost(along, scale)))


def confident(keypoints: ImageKeypoints, least: float) -> ImageKeypoints:
    """Return keypoints without those of a confidence below `least`."""
    known = keypoints.confidence >= max(least, 1e-6)
    return replace(
        keypoints,
        pixels=np.where(known[:, None], keypoints.pixels, np.nan),
        confidence=np.where(known, keypoints.confidence, 0.0),
    )


def measured_reach(keypoints: ImageKeypoints, camera: Camera, depth: Depth, window: float) -> Array:
    """Return the distances (21,) of the surface along the lines of sight.

    They are metres, NaN without a reading.

    depth: (h, w) metres of the hand, 0 = none.
    window: half the side of the square whose median depth is taken, metres at the median depth of the keypoints.
    """
    found = np.full(COUNT, np.nan)
    (height, width), inside = depth.shape, list[tuple[int, int, int]]()
    for k, (u, v) in enumerate(keypoints.pixels):
        if -0.5 <= u < width - 0.5 and -0.5 <= v < height - 0.5:
            inside.append((k, round(float(u)), round(float(v))))
    readings = [z for z in (float(depth[row, column]) for _, column, row in inside) if z > 0]
    if not readings:
        return found
    half = max(1, round(window * camera.fx / float(np.median(readings))))
    for k, column, row in inside:
        near = depth[max(row - half, 0) : max(row + half + 1, 0), max(column - half, 0) : max(column + half + 1, 0)]
        near = near[near > 0]
        if len(near):
            found[k] = np.linalg.norm(camera.unproject(keypoints.pixels[k], np.median(near)))
    return found


def half_thickness(shape: HandShape) -> Array:
    """Return half the thickness (21,) of wrist and fingers at the keypoints, metres."""
    return np.concatenate([[shape.wrist_thickness / 2], shape.radii.ravel()]) * shape.scale
