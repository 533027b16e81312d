"""Workload of the scorers: swarms of hypotheses around four frames of the `everyday` motion."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from depthtrack.geometry.camera import PRESETS
from depthtrack.geometry.rectangle import Rect
from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import TANGENT_SIZE, retract
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.oracle import OracleScorer
from depthtrack.rendering.target import Target
from depthtrack.synthesis.motion import load_motion
from depthtrack.synthesis.viewpoint import Viewpoint
from depthtrack.types import Array

Roi = Literal["native", "96", "64"]
ROIS: tuple[Roi, ...] = ("native", "96", "64")
"""Regions of interest: pixels of the sensor, or reduced to this number of pixels per side."""

HYPOTHESES = 64
"""Hypotheses per frame."""
FRAME_TIMES = (1.0, 4.5, 8.0, 11.0)
"""Times in the motion, s, from the open hand to the closed one."""
DISTANCE = 0.5
"""Camera-to-hand distance, m."""
MARGIN = 1 / 7
"""Margin around the hand, relative to its longer side in the image."""
CHECKED = 8
"""Hypotheses per frame that the oracle also scores."""

# Standard deviations of a swarm in the middle of its generations: m, rad, rad.
_SPREAD = np.repeat([0.01, 0.1, 0.2], [3, 3, TANGENT_SIZE - 6])


@dataclass(frozen=True)
class Workload:
    """Targets at one resolution, and the hypotheses to score on each.

    poses: (frames, HYPOTHESES, 27), camera frame.
    expected: (frames, CHECKED) energies of the oracle for the first hypotheses.
    """

    roi: Roi
    shape: HandShape
    targets: tuple[Target, ...]
    poses: Array
    expected: Array


def make_workloads(rois: Iterable[Roi] = ROIS, seed: int = 0) -> list[Workload]:
    """Return the workloads: ideal observations of a Kinect, the same for each seed."""
    shape, oracle = HandShape(), OracleScorer(HandShape())
    truth = Viewpoint(distance=DISTANCE).transform_poses(load_motion("everyday").poses(np.array(FRAME_TIMES), seed))
    random = np.random.Generator(np.random.Philox(key=seed))
    steps = random.normal(size=(len(truth), HYPOTHESES, TANGENT_SIZE)) * _SPREAD
    poses = within_limits(retract(truth[:, None], steps))
    regions = _regions(oracle, truth)
    return [_workload(roi, shape, oracle, regions, poses) for roi in rois]


def _workload(roi: Roi, shape: HandShape, oracle: OracleScorer, regions: list[Target], poses: Array) -> Workload:
    targets = regions if roi == "native" else [region.reduced(int(roi)) for region in regions]
    expected = []
    for target, swarm in zip(targets, poses, strict=True):
        oracle.set_target(target)
        expected.append(oracle.score(swarm[:CHECKED]))
    return Workload(roi, shape, tuple(targets), poses, np.stack(expected))


def _regions(oracle: OracleScorer, truth: Array) -> list[Target]:
    """Return square regions of equal size around the hands at full resolution."""
    camera = PRESETS["kinect1"]
    oracle.set_target(Target.blank(camera))
    depths = [oracle.render(pose) for pose in truth]
    extents = np.array([[(hit.min(), hit.max() + 1) for hit in np.nonzero(depth)] for depth in depths])
    side = round(float(np.diff(extents, axis=-1).max()) * (1 + MARGIN))
    corners = np.rint(extents.mean(axis=-1) - side / 2).astype(int)
    return [
        Target(camera, depth > 0, depth).crop(Rect.of_size(left, top, side, side))
        for depth, (top, left) in zip(depths, corners, strict=True)
    ]
