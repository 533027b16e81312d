"""The axes of exported files whose standard has y up and z backward."""

import numpy as np

from depthtrack.export.joint_track import JointTrack
from depthtrack.types import Array

_Y_UP: Array = np.diag([1.0, -1.0, -1.0, 1.0])


def export_transform(track: JointTrack) -> Array:
    """Return the transform (4, 4) from the frame of a track to the axes of a standard with y up.

    The camera frame, x right, y down, z forward, becomes x right, y up, z backward: a half turn about x. The frame of
    a capture of markers keeps its own axes.
    """
    return _Y_UP if track.frame == "camera" else np.eye(4)


def frame_text(track: JointTrack) -> str:
    """Return the description of the exported frame."""
    return "camera: x right, y up, z backward" if track.frame == "camera" else "capture: its own axes"
