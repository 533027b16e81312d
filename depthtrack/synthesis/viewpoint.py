"""Where the camera stands: eight viewpoints on the hemisphere around the scene (Oikonomidis et al. 2011, Fig. 2d)."""

from dataclasses import dataclass

import numpy as np

from depthtrack.errors import InputError
from depthtrack.geometry.rotations import quaternion_from_matrix, quaternion_product
from depthtrack.hand.pose import ORIENTATION, POSITION, make_pose
from depthtrack.types import Array

# Degrees away from the front, and which way: 0 to the right of the scene, 90 above it. Frontal, four oblique, three
# nearly from the side; none from straight below, where the forearm is.
_DIRECTIONS = ((0, 0), (40, 0), (40, 90), (40, 180), (40, 270), (75, 0), (75, 90), (75, 180))
VIEWPOINT_COUNT = len(_DIRECTIONS)


@dataclass(frozen=True)
class Viewpoint:
    """Camera `number` (0 frontal to 7) at `distance` metres from the nominal place of the hand, looking at it."""

    number: int = 0
    distance: float = 0.5

    def __post_init__(self) -> None:
        if self.number not in range(VIEWPOINT_COUNT):
            raise InputError(f"viewpoint must be a whole number from 0 to {VIEWPOINT_COUNT - 1}, found {self.number}")
        if not 0.2 <= self.distance <= 3:
            raise InputError(f"distance must lie between 0.2 and 3 m, found {self.distance} m")

    @property
    def transform(self) -> Array:
        """T_camera_scene (4, 4), metres; the scene frame is that of `scene_frame`."""
        off, around = np.radians(_DIRECTIONS[self.number])
        forward = -np.array([np.sin(off) * np.cos(around), -np.sin(off) * np.sin(around), -np.cos(off)])
        right = np.cross([0.0, 1.0, 0.0], forward)
        right /= np.linalg.norm(right)
        T = np.eye(4)
        T[:3, :3] = np.stack([right, np.cross(forward, right), forward])
        T[:3, 3] = [0, 0, self.distance]
        return T

    def see(self, poses: Array) -> Array:
        """Poses (..., 27) of the scene frame in the camera frame."""
        T = self.transform
        position = poses[..., POSITION] @ T[:3, :3].T + T[:3, 3]
        quaternion = quaternion_product(quaternion_from_matrix(T[:3, :3]), poses[..., ORIENTATION])
        return make_pose(position, quaternion, poses[..., 7:])

    def see_points(self, points: Array) -> Array:
        """Points (..., 3) of the scene frame in the camera frame, metres."""
        T = self.transform
        return np.asarray(points @ T[:3, :3].T + T[:3, 3])
