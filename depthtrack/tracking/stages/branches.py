"""Branches: discrete alternatives to the tracked pose.

A palm that is taken for a back fits single frames well, and it goes on to fit while the hand moves little. After a
start, and then once per `interval`, a search proposes other hands. Those that fit almost as well as the tracked pose
are followed beside it, and their energies over time decide.
"""

from dataclasses import dataclass, replace

import numpy as np

from depthtrack.geometry.rotations import quaternion_from_matrix, quaternion_product, rotation_matrix
from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import ANGLES, ORIENTATION, POSITION, make_pose
from depthtrack.recording.branches import Branch
from depthtrack.solver.options import SurfaceFitOptions
from depthtrack.tracking.candidate import Candidate
from depthtrack.tracking.frame import FrameContext
from depthtrack.tracking.options import BranchOptions
from depthtrack.tracking.posture_prior import prior_near
from depthtrack.tracking.proposals.global_ import mixed_angles, orientation_proposals
from depthtrack.tracking.stages.searches import FitSearch
from depthtrack.types import Array

_HALF_TURNS = np.array([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
"""(3, 4) quaternions of half turns about the palm's axes."""
PALM_AND_BACK = 1
"""Index of the half turn about the direction of the fingers, which exchanges palm and back."""


@dataclass(frozen=True)
class CarryBranches:
    """Follow branches beside the tracked pose; replace it by one of better evidence.

    fit: surface fit that follows a branch.
    """

    options: BranchOptions
    fit: SurfaceFitOptions
    name: str = "branches"

    def __call__(self, frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]:
        best, options = candidates[0], self.options
        if frame.restarted or options.interval == 0:
            return candidates
        if frame.deadline.is_over:
            frame.branches = frame.state.branches
            return candidates
        time, carried = frame.observation.timestamp, list[Branch]()
        for branch, found in self._followed(frame, best):
            ratio, age = branch.energy_ratio, time - branch.begun
            if ratio < (options.accept_at_once if age < options.decide_after else options.accept):
                frame.restarted = True
                return [found]
            hopeless = ratio > (options.give_up if age < options.decide_after else options.accept_late)
            if not hopeless and age < options.longest and self._is_distinct(frame, found, best):
                carried.append(branch)
        if not carried and self._is_due(frame):
            others = self._alternatives(frame, best)
            if others and others[0].energy < options.accept_at_once * best.energy:
                frame.restarted = True
                return others
            carried = [Branch(other.pose, time) for other in others]
        frame.branches = tuple(carried)
        return candidates

    def _followed(self, frame: FrameContext, best: Candidate) -> list[tuple[Branch, Candidate]]:
        """Return each branch with the candidate that it was followed to."""
        branches, last = frame.state.branches, frame.state.pose
        if not branches or last is None:
            return []
        fitter, followed = frame.fitter(self.fit), []
        kept = frame.posture_kept(self.fit.icp)
        for branch in branches:
            ahead = frame.evaluate(np.stack([branch.pose, moved_along(branch.pose, last, best.pose)]))[0].pose
            prior = prior_near(branch.pose[ANGLES], kept, self.fit.icp)
            found = frame.evaluate(fitter.fit(ahead, prior=prior)[None])[0]
            followed.append((branch.compared(found.pose, found.energy, best.energy), found))
        return followed

    def _is_due(self, frame: FrameContext) -> bool:
        """Return whether the track is new, or an interval ended since the last frame."""
        before, now = frame.state.time, frame.observation.timestamp
        return frame.state.is_new or now // self.options.interval > before // self.options.interval

    def _alternatives(self, frame: FrameContext, best: Candidate) -> list[Candidate]:
        """Return other hands that fit almost as well as the tracked pose, best first."""
        options, observation = self.options, frame.observation
        generator = frame.new_random()
        angles = mixed_angles(frame.tools.synergies, generator, options.search)
        arm = observation.arm_direction if options.search.follow_arm else None
        anywhere = orientation_proposals(observation.centre, angles, generator, arm, options.search)
        poses = np.concatenate([turned(best.pose, angles[: options.turned]), anywhere])
        fit = replace(self.fit, icp=replace(self.fit.icp, coarse_every=options.coarse_every))
        limit = options.hopeless * best.energy

        def goes_on(found: Candidate) -> bool:
            return found.energy <= limit and self._is_distinct(frame, found, best)

        search, chosen = FitSearch(options.fits, fit, goes_on), [best]
        for found in search.improve(frame, frame.evaluate(poses, options.search.resolution), options.search.min_angle):
            near = found.energy <= options.admit * best.energy
            if near and all(self._is_distinct(frame, found, other) for other in chosen):
                chosen.append(found)
        return chosen[1 : 1 + options.carried]

    def _is_distinct(self, frame: FrameContext, one: Candidate, other: Candidate) -> bool:
        """Return whether the joints of two poses differ by the least distance on average."""
        joints = frame.tools.model.keypoints(np.stack([one.pose, other.pose]))
        return float(np.linalg.norm(joints[0] - joints[1], axis=-1).mean()) >= self.options.least_distance


def turned(pose: Array, angles: Array) -> Array:
    """Return poses (3 (N + 1), 27): half turns of `pose` (27,) about the palm's axes.

    angles: (N, 20) postures, rad, that each of them takes after its own. With N = 0 there is one row per axis.
    """
    postures = np.concatenate([pose[None, ANGLES], angles])
    quaternions = quaternion_product(pose[ORIENTATION], _HALF_TURNS)
    return within_limits(
        make_pose(pose[POSITION], np.repeat(quaternions, len(postures), axis=0), np.tile(postures, (3, 1)))
    )


def moved_along(pose: Array, before: Array, after: Array) -> Array:
    """Return `pose` (27,) moved like a palm that went from pose `before` (27,) to `after` (27,)."""
    R = rotation_matrix(after[ORIENTATION]) @ rotation_matrix(before[ORIENTATION]).T
    position = after[POSITION] + R @ (pose[POSITION] - before[POSITION])
    turned_by = quaternion_product(quaternion_from_matrix(R), pose[ORIENTATION])
    return make_pose(position, turned_by, pose[ANGLES])
