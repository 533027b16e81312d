"""Write a tracker stage of your own, and track with a list of stages that uses it.

A stage takes candidates, best first, and returns candidates, best first. This one climbs down by random steps.
Usage: 08_own_stage.py RECORDING
"""

import sys
from dataclasses import dataclass

import numpy as np

import depthtrack as dt
from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import retract
from depthtrack.tracking.candidate import Candidate, by_energy
from depthtrack.tracking.configuration import IkConfig
from depthtrack.tracking.frame import FrameContext, Toolkit
from depthtrack.tracking.stage_tracker import Stages, StageTracker
from depthtrack.tracking.stages.predict import Predict
from depthtrack.tracking.trackers.ik import ik


@dataclass(frozen=True)
class RandomSteps:
    """Try random steps around the best candidate, `size` times 10 mm and 0.1 rad."""

    size: float
    proposals: int = 400
    name: str = "random_steps"

    def __call__(self, frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]:
        spread = self.size * np.repeat([0.01, 0.1, 0.1], [3, 3, 20])
        steps = frame.random.standard_normal((self.proposals, 26)) * spread
        return by_energy([candidates[0], *frame.evaluate(within_limits(retract(candidates[0].pose, steps)))])


def make_tracker(hand: dt.HandShape, config: IkConfig) -> StageTracker:
    """Return a tracker that follows by random steps, and starts as the IK tracker does."""
    tools = Toolkit(hand, config.scoring)
    usual = ik(config, tools)
    climb = [RandomSteps(size) for size in (1.0, 0.5, 0.25, 0.12)]
    stages = Stages(follow=[Predict((0.0, 1.0)), *climb], start=usual.start, refine=usual.refine)
    return StageTracker("random-steps", stages, tools, config.thresholds, seed=0)


def main(path: str) -> list[dt.Estimate]:
    """Print status and energy of each frame; return the estimates."""
    recording, hand = dt.open_recording(path), dt.HandShape()
    with dt.HandTracker(recording.camera, hand, make_tracker(hand, IkConfig())) as tracker:
        estimates = [tracker.update(frame.depth, frame.colour, timestamp=frame.timestamp) for frame in recording]
    for number, estimate in enumerate(estimates):
        print(f"frame {number}: {estimate.status}, energy {estimate.energy:.2f}")
    return estimates


if __name__ == "__main__":
    main(sys.argv[1])
