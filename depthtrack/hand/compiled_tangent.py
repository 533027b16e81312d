"""Compiled retraction of poses along tangents, and its inverse; `pose` wraps both."""

from depthtrack.compilation import compiled
from depthtrack.geometry.rotations import compiled_exp, compiled_log, compiled_normalised, compiled_product
from depthtrack.types import Array


@compiled(nogil=True)
def retract(pose: Array, tangent: Array, out: Array) -> None:
    """Write the pose `out` (27,) reached from `pose` by a step (26,); see `pose.retract`."""
    retract_unnormalised(pose, tangent, out)
    out[3], out[4], out[5], out[6] = compiled_normalised(out[3], out[4], out[5], out[6])


@compiled(nogil=True)
def retract_unnormalised(pose: Array, tangent: Array, out: Array) -> None:
    """Write the retraction to `out` (27,) without normalising its quaternion.

    The quaternion is unit up to rounding, of either sign. Forward kinematics accepts any length.
    """
    for i in range(3):
        out[i] = pose[i] + tangent[i]
    w, x, y, z = compiled_exp(tangent[3], tangent[4], tangent[5])
    out[3], out[4], out[5], out[6] = compiled_product(w, x, y, z, pose[3], pose[4], pose[5], pose[6])
    for i in range(20):
        out[7 + i] = pose[7 + i] + tangent[6 + i]


@compiled(nogil=True)
def retract_rows(poses: Array, tangents: Array, out: Array) -> None:
    """Write the poses `out` (N, 27) reached from poses (N, 27) by steps (N, 26)."""
    for n in range(poses.shape[0]):
        retract(poses[n], tangents[n], out[n])


@compiled(nogil=True)
def tangent_rows(starts: Array, ends: Array, out: Array) -> None:
    """Write the steps `out` (N, 26) from poses (N, 27) to others; see `pose.tangent_between`."""
    for n in range(starts.shape[0]):
        a, b, step = starts[n], ends[n], out[n]
        for i in range(3):
            step[i] = b[i] - a[i]
        w, x, y, z = compiled_product(b[3], b[4], b[5], b[6], a[3], -a[4], -a[5], -a[6])
        step[3], step[4], step[5] = compiled_log(w, x, y, z)
        for i in range(20):
            step[6 + i] = b[7 + i] - a[7 + i]
