"""Random poses of hands."""

import numpy as np

from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.pose import make_pose


def random_pose(rng: np.random.Generator) -> np.ndarray:
    """Return a pose (27,) within the limits, about half a metre in front of the camera."""
    return make_pose(rng.normal([0, 0, 0.5], 0.1), rng.normal(size=4), rng.uniform(LOWER, UPPER))


def random_pose_in_view(seed: int, *batch: int) -> np.ndarray:
    """Return poses (*batch, 27) within the limits, in view of a camera 0.3 to 0.9 m away."""
    rng = np.random.default_rng(seed)
    return make_pose(
        rng.uniform([-0.3, -0.3, 0.3], [0.3, 0.3, 0.9], (*batch, 3)),
        rng.normal(size=(*batch, 4)),
        rng.uniform(LOWER, UPPER, (*batch, 20)),
    )
