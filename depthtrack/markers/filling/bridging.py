"""Poses across frames in which some parameters are not determined."""

import numpy as np

from depthtrack.hand.limits import within_limits
from depthtrack.hand.pose import ORIENTATION, POSITION, make_pose, retract, tangent_between
from depthtrack.markers.filled_capture import measured_samples, runs
from depthtrack.markers.filling.interpolation import minimal_acceleration
from depthtrack.types import Array, Mask


def bridged(poses: Array, known: Mask) -> Array:
    """Return the poses (T, 27) with unknown parameters interpolated.

    poses: (T, 27) capture frame.
    known: (T, 26) whether a frame determines a parameter of the tangent space, see `joints.determined`.

    Several gaps are filled at once: every parameter bridges its own. At the start and the end of the capture,
    parameters keep the nearest known value. All poses of a parameter that is never known stay as they are.
    """
    filled = np.array(poses)
    known = known & measured_samples(poses)[:, None]
    for start, stop in runs(~known[:, 0]):
        filled[start:stop, :7] = _rigid_bridge(poses, start, stop, known[:, 0])
    for j in range(20):
        for start, stop in runs(~known[:, 6 + j]):
            filled[start:stop, 7 + j] = _bridge(poses[:, 7 + j], start, stop, known[:, 6 + j])
    return within_limits(filled)


def _rigid_bridge(poses: Array, start: int, stop: int, known: Mask) -> Array:
    """Return position and orientation (n, 7) of the frames `start` to `stop` - 1."""
    if start == 0 and stop == len(poses):
        return poses[:, :7]
    nearest = poses[start - 1 if start > 0 else stop]
    reference = make_pose(nearest[POSITION], nearest[ORIENTATION], np.zeros(20))
    neighbours = np.clip(np.arange(start - 2, stop + 2), 0, len(poses) - 1)
    steps = np.full((len(poses), 6), np.nan)
    usable = neighbours[np.isfinite(poses[neighbours]).all(axis=1)]
    steps[usable] = tangent_between(reference, poses[usable])[:, :6]
    bridge = np.zeros((stop - start, 26))
    bridge[:, :6] = _bridge(steps, start, stop, known)
    return np.asarray(retract(reference, bridge)[:, :7])


def _bridge(values: Array, start: int, stop: int, known: Mask) -> Array:
    """Return the values (n, ...) of the unknown frames `start` to `stop` - 1."""
    last = len(values)
    if start == 0 and stop == last:
        return values
    if start == 0 or stop == last:
        return np.repeat(values[None, stop if start == 0 else start - 1], stop - start, axis=0)
    # With a single known frame at an end, the derivative there is zero.
    earlier = start - 2 if start >= 2 and known[start - 2] else start - 1
    later = stop + 1 if stop + 1 < last and known[stop + 1] else stop
    return minimal_acceleration(values[[earlier, start - 1]], values[[stop, later]], stop - start)
