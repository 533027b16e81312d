"""Self-check of a backend: its agreement with the oracle on a small scene, and its speed.

`python -m depthtrack.rendering.selfcheck NAME [OPTIONS as JSON]` prints the result as JSON, or {"error": ...}.
A separate process contains a driver that crashes or hangs.
"""

import sys
import time
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from depthtrack.errors import DepthtrackError
from depthtrack.geometry.camera import PRESETS
from depthtrack.geometry.rectangle import Rect
from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import TANGENT_SIZE, make_pose, retract
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.backends import create_scorer
from depthtrack.rendering.options import Objective
from depthtrack.rendering.oracle import OracleScorer
from depthtrack.rendering.scorer import Scorer
from depthtrack.rendering.target import Target
from depthtrack.strict_data import json_text, parse_json
from depthtrack.types import Array

HYPOTHESES, SIDE = 64, 64
_SEED = 50
"""The first seed from 0 that leaves no pixel within half a micrometre of d_m, where float32 rounding would decide."""
_OCCLUDER = 0.477
"""Metres: depth of an object that hides half of what is drawn behind it, with no pixel within a micrometre."""
_SURROUNDINGS = 0.465
"""Metres: depth of readings at the bottom of the image, which hide a part of what is drawn behind them."""
_OBJECTIVE = Objective(before_cost=0.5)
"""Pixels before the object count neither once more nor not at all, so that an error in either shows."""
ENERGY_TOLERANCE = 1e-3
DEPTH_TOLERANCE = 1e-4
"""Metres."""
SILHOUETTE_TOLERANCE = 1e-3
"""Share of the silhouette's pixels."""


@dataclass(frozen=True)
class SelfCheck:
    """Largest differences of a backend from the oracle, and its best speed at 64 x 64 pixels.

    depth_difference: metres, over the pixels that both drew.
    silhouette_pixels: pixels that differ, among the `silhouette_total` that the oracle drew.
    """

    renderer: str
    software: bool
    energy_difference: float
    depth_difference: float
    silhouette_pixels: int
    silhouette_total: int
    hypotheses_per_s: float

    @property
    def agrees(self) -> bool:
        """Whether all differences are within the tolerances."""
        return (
            self.energy_difference <= ENERGY_TOLERANCE
            and self.depth_difference <= DEPTH_TOLERANCE
            and self.silhouette_pixels <= SILHOUETTE_TOLERANCE * self.silhouette_total
        )


def scene() -> tuple[HandShape, Target, Array]:
    """Return a hand, its target of 64 x 64 pixels, and poses (64, 27) around the true one.

    An object hides the left third of the image behind it, and other readings the bottom third. They do not hide all of
    the poses there.
    """
    shape = HandShape()
    truth = within_limits(make_pose([0, 0, 0.5], [0.1, 1, 0.2, 0.1], np.full(20, 0.3)))
    rng = np.random.Generator(np.random.Philox(key=_SEED))
    spread = np.repeat([0.005, 0.1, 0.1], [3, 3, 20])
    poses = within_limits(retract(truth, rng.normal(size=(HYPOTHESES, TANGENT_SIZE)) * spread))
    camera = PRESETS["kinect1"].crop(Rect.of_size(210, 135, 220, 220)).resized(SIDE / 220)
    blank = Target.blank(camera)
    with OracleScorer(shape) as oracle:
        oracle.set_target(blank)
        depth = oracle.render(truth)
    occluder = np.zeros(camera.shape, np.float32)
    occluder[:, : SIDE // 3] = _OCCLUDER
    surroundings = np.zeros(camera.shape, np.float32)
    surroundings[-(SIDE // 3) :] = _SURROUNDINGS
    seen = np.where((occluder > 0) | (surroundings > 0), np.float32(0), depth)
    return shape, Target(camera, seen > 0, seen, occluder=occluder, surroundings=surroundings), poses


def self_check(name: str, seconds: float = 0.7, **options: Any) -> SelfCheck:
    """Compare a backend with the oracle on `scene`, and time it for about `seconds`.

    Raises:
        DepthtrackError: see `create_scorer`.
    """
    shape, target, poses = scene()
    with create_scorer(name, shape, _OBJECTIVE, **options) as scorer, OracleScorer(shape, _OBJECTIVE) as oracle:
        scorer.set_target(target)
        oracle.set_target(target)
        energies = np.abs(scorer.score(poses) - oracle.score(poses))
        drawn = np.stack([scorer.render(pose) for pose in poses])
        true = np.stack([oracle.render(pose) for pose in poses])
        both = (drawn > 0) & (true > 0)
        return SelfCheck(
            renderer=getattr(scorer, "renderer", "numba"),
            software=getattr(scorer, "software", True),
            energy_difference=float(energies.max()),
            depth_difference=float(np.abs(drawn - true)[both].max(initial=0)),
            silhouette_pixels=int(np.count_nonzero((drawn > 0) != (true > 0))),
            silhouette_total=int(np.count_nonzero(true > 0)),
            hypotheses_per_s=_speed(scorer, poses, seconds),
        )


def _speed(scorer: Scorer, poses: Array, seconds: float) -> float:
    """Return hypotheses a second of the fastest call, the one least slowed by other load."""
    best, end = np.inf, time.perf_counter() + seconds
    while (start := time.perf_counter()) < end:
        scorer.score(poses)
        best = min(best, time.perf_counter() - start)
    return len(poses) / best


def main() -> int:
    """Print the self-check of the backend named on the command line; return the exit code."""
    name, *rest = sys.argv[1:]
    try:
        result: dict[str, Any] = asdict(self_check(name, **(parse_json(rest[0]) if rest else {})))
    except DepthtrackError as error:
        result = {"error": str(error)}
    print(json_text(result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
