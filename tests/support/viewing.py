"""A camera, a plain image and a hand in view, for the tests of pictures."""

import numpy as np
from numpy.typing import NDArray

from depthtrack.geometry.camera import Camera
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import make_pose
from depthtrack.hand.shape import HandShape

CAMERA = Camera(320, 240, 280.0, 290.0, 158.0, 121.5)
GREY = np.full((240, 320, 3), 90, dtype=np.uint8)


def open_hand() -> NDArray[np.float64]:
    """Keypoints (21, 3) of an open right hand, its palm towards the camera at 0.4 m."""
    pose = make_pose([0.0, 0.02, 0.4], [0.0, 1.0, 0.0, 0.0], np.zeros(20))
    return HandModel(HandShape()).keypoints(pose)
