"""The frame in which motions are written, and the readable angles that orient the hand in it.

The scene frame is that of a camera that looks at the hand from the front, its origin at the nominal place of the
palm: x right, y down, z away from that camera, metres. At rest the palm faces the camera, fingers up.
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from depthtrack.types import Array


def orientation(tilt: ArrayLike, nod: ArrayLike, turn: ArrayLike) -> Array:
    """Quaternion (..., 4) of the palm in the scene frame from three angles (...) in radians.

    `turn` about the hand's long axis: 0 shows the palm, pi the back, pi/2 the little finger's edge (a right hand
    supinates); then `nod` tips the fingers towards the camera; then `tilt` leans them to the right.
    """
    about_y, about_x, about_z = np.broadcast_arrays(-np.asarray(turn), nod, tilt)
    euler = np.stack([about_z, about_x, about_y], axis=-1)
    # The palm at rest: half a turn about x from the axes of the scene.
    rest = Rotation.from_euler("x", np.pi)
    xyzw = (Rotation.from_euler("ZXY", euler.reshape(-1, 3)) * rest).as_quat()
    return np.asarray(xyzw[:, [3, 0, 1, 2]].reshape(*euler.shape[:-1], 4))


def mirrored(poses: Array) -> Array:
    """Left hand's poses (..., 27) that mirror a right hand's in x, and the other way round."""
    flip = np.ones(27)
    flip[[0, 5, 6]] = -1  # position x; rotations about y and z
    return poses * flip
