"""Proposals from keypoints of another detector: lifted poses compete by their energy."""

from dataclasses import dataclass

import numpy as np

from depthtrack.hand.pose import ANGLES
from depthtrack.recording.sequence import ImageKeypoints
from depthtrack.solver.lifting import Lifter
from depthtrack.solver.options import SurfaceFitOptions
from depthtrack.solver.prior import Prior
from depthtrack.solver.reprojection import mean_misfit
from depthtrack.tracking.candidate import Candidate
from depthtrack.tracking.frame import FrameContext
from depthtrack.tracking.options import KeypointOptions
from depthtrack.types import Array


@dataclass(frozen=True)
class KeypointProposals:
    """Lift the keypoints of the frame if the best pose contradicts them.

    Proposals are the lifted pose, and the best pose with the lifted angles of the fingers that contradict theirs. Each
    is scored as it is and after a surface fit. The energy decides. Where it is level, as of hidden fingers, the
    keypoints decide. Frames without keypoints are left alone.

    fit: surface fit of the proposals.
    """

    options: KeypointOptions
    fit: SurfaceFitOptions
    name: str = "keypoints"

    def __call__(self, frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]:
        keypoints, options = frame.observation.keypoints, self.options
        if keypoints is None:
            return candidates
        lifter, best = frame.tools.lifter(options.lift), candidates[0]
        misfits = lifter.misfits(best.pose, keypoints, frame.observation.camera)
        if mean_misfit(misfits) <= options.contradicted:
            return candidates
        fitter = frame.fitter(self.fit)
        trust = fitter.keypoint_trust(best.pose)
        proposals = self._proposals(frame, lifter, keypoints, best, misfits if trust > 0 else np.zeros_like(misfits))
        if not len(proposals):
            return candidates
        weight = self.fit.icp.temporal_weight
        fitted = [fitter.fit(pose, prior=Prior.towards(pose[ANGLES], weight)) for pose in proposals]
        found = frame.evaluate(np.concatenate([proposals, fitted]))

        def rank(candidate: Candidate) -> float:
            costs = lifter.misfits(candidate.pose, keypoints, frame.observation.camera)
            return candidate.energy * (1 + options.tie * trust * mean_misfit(costs))

        chosen = min(found, key=rank)
        return [chosen] if rank(chosen) < options.accept * rank(best) else candidates

    def _proposals(
        self, frame: FrameContext, lifter: Lifter, keypoints: ImageKeypoints, best: Candidate, misfits: Array
    ) -> Array:
        """Return the proposed poses (N, 27)."""
        observation = frame.observation
        lifted = lifter.lift(keypoints, observation.camera, observation.depth, frame.last_pose)
        if lifted is None:
            return np.empty((0, 27))
        costs = [mean_misfit(finger) for finger in misfits[1:].reshape(5, 4)]
        moved = np.repeat(np.array(costs) > self.options.finger, 4)
        mixed = best.pose.copy()
        mixed[ANGLES] = np.where(moved, lifted.pose[ANGLES], best.pose[ANGLES])
        return np.stack([lifted.pose, mixed] if moved.any() else [lifted.pose])
