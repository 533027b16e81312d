"""A hand in a posture, shaded, its fingers in their colours."""

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
"""Metres to the hand: far enough that a picture shows little perspective."""
_REACH = 0.22
"""Metres that a picture spans, of a hand of scale 1."""
_TURN = np.radians(-50)
"""Away from the view into the palm, towards the thumb's side, from which flexion shows best."""
_FINER = 3
"""Rendered so many times larger, then averaged: smooth edges."""


def hand_picture(skin: Skin, angles: ArrayLike, size: int) -> Image:
    """Square RGB picture (size, size, 3) of the hand with these finger angles (20,), seen from the thumb's side."""
    side = size * _FINER
    focal = side * _DISTANCE / (_REACH * skin.shape.scale)
    camera = Camera(side, side, focal, focal, side / 2, side / 2)
    vertices = skin.at(make_pose([0, 0, _DISTANCE], _orientation(skin.shape.mirror), angles))
    # The hand in the middle of the picture, wherever its fingers are.
    vertices[:, :2] -= (vertices[:, :2].min(axis=0) + vertices[:, :2].max(axis=0)) / 2
    surface = rasterise(camera, vertices, skin.faces, skin.normals(vertices), skin.face_bodies)
    return smaller(draw_surface(blank(side, side, SURFACE), surface), size, size)


def _orientation(mirror: float) -> Array:
    """Quaternion of a palm with the fingers up, turned from facing the camera towards the thumb's side."""
    facing = quaternion_exp([np.pi, 0, 0])
    return quaternion_product(quaternion_exp([0, _TURN * mirror, 0]), facing)
