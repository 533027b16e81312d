"""The scene frame, in which motions are defined, and the angles that orient the palm in it.

The origin is the nominal palm position. The axes are those of a camera in front of the hand: x right, y down, z away
from that camera, metres. In the neutral orientation the palm faces the camera, fingers up.
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from depthtrack.types import Array


def orientation(tilt: ArrayLike, nod: ArrayLike, turn: ArrayLike) -> Array:
    """Return the palm's orientation in the scene frame from three angles.

    The rotations are applied in the order turn, nod, tilt.

    turn (...): about the hand's long axis, radians; 0 shows the palm, pi/2 the little finger's edge, pi the back.
    nod (...): tips the fingers towards the camera, radians.
    tilt (...): leans the fingers to the right, radians.
    Result (..., 4): quaternions w x y z.
    """
    about_y, about_x, about_z = np.broadcast_arrays(-np.asarray(turn), nod, tilt)
    euler = np.stack([about_z, about_x, about_y], axis=-1)
    # The neutral palm is rotated by pi about the scene's x axis.
    neutral = Rotation.from_euler("x", np.pi)
    xyzw = (Rotation.from_euler("ZXY", euler.reshape(-1, 3)) * neutral).as_quat()
    return np.asarray(xyzw[:, [3, 0, 1, 2]].reshape(*euler.shape[:-1], 4))


def mirrored(poses: Array) -> Array:
    """Return poses (..., 27) of the other side's hand, mirrored in x."""
    flip = np.ones(27)
    flip[[0, 5, 6]] = -1  # position x; rotations about y and z
    return poses * flip
