"""Shaded pictures of a hand posture, one colour per finger."""

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rotations import quaternion_exp, quaternion_product
from depthtrack.hand.pose import make_pose
from depthtrack.hand.skin.mesh import Skin
from depthtrack.rendering.triangles import rasterise
from depthtrack.types import Array, Image
from depthtrack.viewing.panels import blank, smaller
from depthtrack.viewing.shading import draw_surface
from depthtrack.viewing.theme import SURFACE

_DISTANCE = 1.0
"""Distance of the hand, metres; large for a weak perspective."""
_SPAN = 0.22
"""Side of the picture at the hand's distance for a hand of scale 1, metres."""
_TURN = np.radians(-50)
"""Rotation from the palmar view towards the thumb's side, which shows flexion best."""
_SUPERSAMPLING = 3
"""Rendering resolution relative to the picture, for smooth edges."""


def hand_picture(skin: Skin, angles: ArrayLike, size: int) -> Image:
    """Return a picture of the hand, seen from the thumb's side.

    angles (20,): finger angles, radians.
    Result (size, size, 3): RGB.
    """
    side = size * _SUPERSAMPLING
    focal = side * _DISTANCE / (_SPAN * skin.shape.scale)
    camera = Camera(side, side, focal, focal, side / 2, side / 2)
    vertices = skin.at(make_pose([0, 0, _DISTANCE], _orientation(skin.shape.mirror), angles))
    # Centre the hand's bounding box in the picture.
    vertices[:, :2] -= (vertices[:, :2].min(axis=0) + vertices[:, :2].max(axis=0)) / 2
    surface = rasterise(camera, vertices, skin.faces, skin.normals(vertices), skin.face_bodies)
    return smaller(draw_surface(blank(side, side, SURFACE), surface), size, size)


def _orientation(mirror: float) -> Array:
    """Return the palm's quaternion: fingers up, rotated towards the thumb's side."""
    facing = quaternion_exp([np.pi, 0, 0])
    return quaternion_product(quaternion_exp([0, _TURN * mirror, 0]), facing)
