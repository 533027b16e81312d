"""Export to OpenSim's .mot: a motion of joint angles in degrees.

Source: OpenSim documentation, "Motion (.mot) Files".
"""

import warnings
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from depthtrack.export.joint_track import JointTrack
from depthtrack.files import write_atomic
from depthtrack.hand.pose import ANGLE_NAMES, ANGLES, ORIENTATION, POSITION
from depthtrack.types import Array

PALM_NAMES = ("palm_rx", "palm_ry", "palm_rz", "palm_tx", "palm_ty", "palm_tz")
"""Coordinates of the palm: rotations about its own x, then y, then z axis, in degrees, then its centre in metres."""
COLUMNS = ("time", *PALM_NAMES, *ANGLE_NAMES)


def write(track: JointTrack, path: Path) -> None:
    """Write the angles of the frames with a pose; OpenSim interpolates between rows.

    Angles of the palm do not jump by a full turn. Numbers have 10 digits.

    Raises:
        InputError: if no frame has a pose, or the file cannot be written.
    """
    track.check_posed()
    posed = track.posed
    poses = track.poses[posed]
    degrees = np.degrees(poses[:, ANGLES])
    table = np.column_stack([track.timestamps[posed], palm_rotations(poses), poses[:, POSITION], degrees])
    head = [path.stem, "version=1", f"nRows={len(table)}", f"nColumns={len(COLUMNS)}", "inDegrees=yes", "endheader"]
    rows = ("\t".join(f"{value:.10g}" for value in row) for row in table.tolist())
    write_atomic(path, "\n".join([*head, "\t".join(COLUMNS), *rows]) + "\n")


def palm_rotations(poses: Array) -> Array:
    """Return the angles (T, 3) of poses (T, 27) about the palm's x, y, z in turn, degrees."""
    with warnings.catch_warnings():
        # With y at 90 degrees x and z are the same axis; any split between them is right.
        warnings.simplefilter("ignore", UserWarning)
        angles = Rotation.from_quat(poses[:, ORIENTATION], scalar_first=True).as_euler("XYZ")
    return np.asarray(np.degrees(np.unwrap(angles, axis=0)))
