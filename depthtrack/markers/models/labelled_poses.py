"""The pose of a hand in a frame of labelled markers, from typical postures if none is known."""

import numpy as np

from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import make_pose
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.size_parameters import COUNT
from depthtrack.markers.models.sized_fit import SizedFitter
from depthtrack.solver.point_fit import aligned_poses
from depthtrack.types import Array

_STARTS = ("relaxed", "open", "grasp", "fist")
_FINGER_WEIGHT = 0.1
"""Weight of the markers of the fingers in the alignment of a start, against 1 of those of the palm."""


def fit_labelled_frame(fitter: SizedFitter, points: Array, known: Array | None = None) -> tuple[Array, float]:
    """Return the pose (27,) that fits labelled points, and its energy.

    points: (M, 3) metres, NaN if not measured.
    known: (27,) pose to start from; that and typical postures compete. NaN if unknown.
    """
    seen = np.asarray(np.isfinite(points).all(axis=-1))
    assigned, targets = np.where(seen, np.arange(len(points)), -1), np.where(seen[:, None], points, 0.0)
    weights = np.where(np.asarray(fitter.model.bodies) == 0, 1.0, _FINGER_WEIGHT) * seen
    starts = [] if known is None or not np.isfinite(known).all() else [within_limits(known)]
    for name in () if starts else _STARTS:
        rest = make_pose(np.zeros(3), (1, 0, 0, 0), POSTURES[name])
        starts.append(aligned_poses(POSTURES[name], fitter.model.positions(rest), targets, weights))
    energies = [fitter.fit(pose, np.zeros(COUNT), targets, assigned)[0] for pose in starts]
    best = int(np.argmin(energies))
    return starts[best], energies[best]
