"""A bare forearm for the hand: one closed tube from inside the palm, around the wrist's bend, to the elbow.

Sizes: wrist from `HandShape`; the rest in proportion to it, from the means of men and women in Gordon et al., "1988
Anthropometric Survey of U.S. Army Personnel" (Natick TR-89/044): radiale-stylion length 25.7 cm, forearm
circumference 28 cm against 16.3 cm around the wrist.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation

from depthtrack.hand.shape import HandShape
from depthtrack.types import Array, Index

LENGTH = 0.257
"""Wrist to elbow, metres, of a hand of scale 1."""
LARGEST_BEND = np.radians(30)
"""How far the wrist bends at most, out of 60 to 70 degrees of flexion and 20 to 30 sideways that it could."""
_INSIDE = 0.012
_BEND_OVER = 0.035
_SECTIONS = 36
_RINGS = 26
# Along the forearm (0 wrist, 1 elbow): breadth and thickness as multiples of the wrist's.
_PROFILE = np.array(
    [(-0.05, 0.8, 0.6), (0, 1.09, 1.11), (0.08, 1.02, 1.06), (0.3, 1.2, 1.45), (0.7, 1.52, 2.05), (1, 1.4, 1.85)]
)


@dataclass(frozen=True)
class Forearm:
    """The forearm of a hand of given sizes; its frame is the palm's, turned about the wrist by the wrist's bend."""

    shape: HandShape

    @cached_property
    def faces(self) -> Index:
        """(F, 3) triangles: the rings' walls, and a fan at either end."""
        here = np.arange(_SECTIONS)
        there = np.roll(here, -1)
        faces = []
        for a in _SECTIONS * np.arange(_RINGS - 1):
            b = a + _SECTIONS
            faces += [(a + here, b + there, b + here), (a + here, a + there, b + there)]
        hub, end = np.full(_SECTIONS, _SECTIONS * _RINGS), _SECTIONS * (_RINGS - 1)
        faces += [(hub, there, here), (end + here, end + there, hub + 1)]
        return np.concatenate([np.stack(corners, axis=-1) for corners in faces])

    def bend(self, T_camera_palm: Array, elbow: Array) -> Array:
        """Rotation vector (3,) of the wrist in the palm frame, that turns the forearm towards `elbow` (3,), metres."""
        along = np.array([0.0, -1.0, 0.0])
        towards = T_camera_palm[:3, :3].T @ (elbow - T_camera_palm[:3, 3]) - self.shape.wrist
        axis = np.cross(along, towards)
        sine, cosine = np.linalg.norm(axis), along @ towards
        if sine < 1e-9:
            return np.zeros(3)
        angle = np.arctan2(sine, cosine)
        # Soft: it follows an elbow nearby and gives up smoothly on one that the wrist cannot reach.
        return np.asarray(axis / sine * LARGEST_BEND * np.tanh(angle / LARGEST_BEND))

    def frame(self, T_camera_palm: Array, bend: Array) -> Array:
        """T_camera_forearm (4, 4): the palm's frame turned about the wrist."""
        T = np.eye(4)
        T[:3, :3] = Rotation.from_rotvec(bend).as_matrix()
        T[:3, 3] = self.shape.wrist - T[:3, :3] @ self.shape.wrist
        return np.asarray(T_camera_palm @ T)

    def mesh(self, T_camera_palm: Array, bend: Array) -> tuple[Array, Array]:
        """Vertices (V, 3) in metres and unit normals (V, 3), outward, in the camera frame."""
        s, half_breadth, half_thickness = self._profile
        scale = self.shape.scale
        # The bend is shared out over the wrist, from the palm's end to where the forearm is straight.
        share = np.clip((s + _INSIDE * scale) / (_BEND_OVER * scale), 0, 1)
        turns = Rotation.from_rotvec(bend * (share**2 * (3 - 2 * share))[:, None]).as_matrix()
        centres = self._centres(s, turns)
        around = 2 * np.pi * np.arange(_SECTIONS) / _SECTIONS
        c, z = np.cos(around), np.sin(around)
        ring = np.stack(
            [half_breadth[:, None] * c, np.zeros((len(s), _SECTIONS)), half_thickness[:, None] * z], axis=-1
        )
        points = centres[:, None] + np.einsum("rij,rsj->rsi", turns, ring)
        along = np.gradient(points, axis=0)
        across = np.roll(points, -1, axis=1) - np.roll(points, 1, axis=1)
        normals = np.cross(across, along)
        normals = np.concatenate([normals.reshape(-1, 3), turns[0, :, 1:2].T, -turns[-1, :, 1:2].T])
        vertices = np.concatenate([points.reshape(-1, 3), centres[[0, -1]]])
        R, t = T_camera_palm[:3, :3], T_camera_palm[:3, 3]
        return vertices @ R.T + t, normals / np.linalg.norm(normals, axis=-1, keepdims=True) @ R.T

    @cached_property
    def _profile(self) -> tuple[Array, Array, Array]:
        """Distance of each ring from the wrist (metres, negative inside the palm), half breadth, half thickness."""
        scale = self.shape.scale
        wall = np.concatenate([np.linspace(-_INSIDE, _BEND_OVER, 10), np.linspace(_BEND_OVER, LENGTH, 11)[1:]])
        widths = PchipInterpolator(_PROFILE[:, 0] * LENGTH, _PROFILE[:, 1:])(wall)
        # The elbow's end is rounded off as half an ellipsoid.
        cap = np.sin(np.linspace(0, np.pi / 2, _RINGS - len(wall) + 2)[1:-1])
        wall = np.concatenate([wall, LENGTH + 0.03 * cap])
        widths = np.concatenate([widths, widths[-1] * np.sqrt(1 - cap**2)[:, None]])
        half = widths * np.array([self.shape.wrist_breadth, self.shape.wrist_thickness]) / 2 * scale
        return wall * scale, half[:, 0], half[:, 1]

    def _centres(self, s: Array, turns: Array) -> Array:
        """Middle line (R, 3) in the palm frame: each step goes the way the forearm points there."""
        down = -turns[:, :, 1]
        steps = (down[1:] + down[:-1]) / 2 * np.diff(s)[:, None]
        start = self.shape.wrist + np.array([0, -s[0], 0])
        return np.concatenate([start[None], start + np.cumsum(steps, axis=0)])
