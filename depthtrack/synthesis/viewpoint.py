"""Camera positions: eight viewpoints on a hemisphere around the scene.

See Oikonomidis et al. 2011, Fig. 2d.
"""

from dataclasses import dataclass

import numpy as np

from depthtrack.errors import InputError
from depthtrack.geometry.rotations import quaternion_from_matrix, quaternion_product
from depthtrack.hand.pose import ORIENTATION, POSITION, make_pose
from depthtrack.types import Array

# Degrees from the front, and azimuth: 0 to the right of the scene, 90 above it. One frontal, four oblique and three
# lateral viewpoints; none from below, where the forearm is.
_DIRECTIONS = ((0, 0), (40, 0), (40, 90), (40, 180), (40, 270), (75, 0), (75, 90), (75, 180))
VIEWPOINT_COUNT = len(_DIRECTIONS)


@dataclass(frozen=True)
class Viewpoint:
    """A camera position, directed at the nominal palm position.

    number: 0 (frontal) to 7.
    distance: metres to the nominal palm position.
    Raises: InputError if the number or the distance is out of range.
    """

    number: int = 0
    distance: float = 0.5

    def __post_init__(self) -> None:
        if self.number not in range(VIEWPOINT_COUNT):
            raise InputError(f"viewpoint must be a whole number from 0 to {VIEWPOINT_COUNT - 1}, found {self.number}")
        if not 0.2 <= self.distance <= 3:
            raise InputError(f"distance must lie between 0.2 and 3 m, found {self.distance:g} m")

    @property
    def transform(self) -> Array:
        """Return T_camera_scene (4, 4), metres; see `scene_frame`."""
        off, around = np.radians(_DIRECTIONS[self.number])
        forward = -np.array([np.sin(off) * np.cos(around), -np.sin(off) * np.sin(around), -np.cos(off)])
        right = np.cross([0.0, 1.0, 0.0], forward)
        right /= np.linalg.norm(right)
        T = np.eye(4)
        T[:3, :3] = np.stack([right, np.cross(forward, right), forward])
        T[:3, 3] = [0, 0, self.distance]
        return T

    def transform_poses(self, poses: Array) -> Array:
        """Transform poses (..., 27) from the scene frame to the camera frame."""
        T = self.transform
        position = poses[..., POSITION] @ T[:3, :3].T + T[:3, 3]
        quaternion = quaternion_product(quaternion_from_matrix(T[:3, :3]), poses[..., ORIENTATION])
        return make_pose(position, quaternion, poses[..., 7:])

    def transform_points(self, points: Array) -> Array:
        """Transform points (..., 3), metres, from the scene frame to the camera frame."""
        T = self.transform
        return np.asarray(points @ T[:3, :3].T + T[:3, 3])
