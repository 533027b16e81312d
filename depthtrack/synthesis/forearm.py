"""A bare forearm: a closed mesh from inside the palm, through the bent wrist, to the elbow.

`HandShape` gives the wrist's size; all other sizes are in proportion to it. The proportions are the means of men and
women in Gordon et al., "1988 Anthropometric Survey of U.S. Army Personnel" (Natick TR-89/044). Radiale-stylion length
is 25.7 cm; the circumference is 28 cm at the forearm and 16.3 cm at the wrist.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation

from depthtrack.hand.shape import HandShape
from depthtrack.types import Array, Index

LENGTH = 0.257
"""Wrist to elbow for a hand of scale 1, metres."""
LARGEST_BEND = np.radians(30)
"""Largest bend of the wrist, radians; anatomical limits are 60 to 70 degrees of flexion, 20 to 30 of deviation."""
_INSIDE = 0.012
_BEND_OVER = 0.035
_SECTIONS = 36
_RINGS = 26
# Position along the forearm (0 wrist, 1 elbow); breadth and thickness as multiples of the wrist's.
_PROFILE = np.array(
    [(-0.05, 0.8, 0.6), (0, 1.09, 1.11), (0.08, 1.02, 1.06), (0.3, 1.2, 1.45), (0.7, 1.52, 2.05), (1, 1.4, 1.85)]
)


@dataclass(frozen=True)
class Forearm:
    """The forearm of a hand of given sizes; its frame is the palm's, rotated about the wrist."""

    shape: HandShape

    @cached_property
    def faces(self) -> Index:
        """Return the triangles (F, 3): the wall between rings and a fan at either end."""
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
        """Return the wrist's rotation that points the forearm towards the elbow.

        T_camera_palm (4, 4): palm frame to camera frame, metres.
        elbow (3,): metres, camera frame.
        Result (3,): rotation vector, radians, palm frame.
        """
        along = np.array([0.0, -1.0, 0.0])
        towards = T_camera_palm[:3, :3].T @ (elbow - T_camera_palm[:3, 3]) - self.shape.wrist
        axis = np.cross(along, towards)
        sine, cosine = np.linalg.norm(axis), along @ towards
        if sine < 1e-9:
            return np.zeros(3)
        angle = np.arctan2(sine, cosine)
        # A soft limit: the derivative stays continuous if the elbow moves out of the wrist's range.
        return np.asarray(axis / sine * LARGEST_BEND * np.tanh(angle / LARGEST_BEND))

    def frame(self, T_camera_palm: Array, bend: Array) -> Array:
        """Return the forearm frame.

        T_camera_palm (4, 4): palm frame to camera frame, metres.
        bend (3,): rotation vector of the wrist, radians, palm frame.
        Result T_camera_forearm (4, 4): forearm frame to camera frame, metres.
        """
        T = np.eye(4)
        T[:3, :3] = Rotation.from_rotvec(bend).as_matrix()
        T[:3, 3] = self.shape.wrist - T[:3, :3] @ self.shape.wrist
        return np.asarray(T_camera_palm @ T)

    def mesh(self, T_camera_palm: Array, bend: Array) -> tuple[Array, Array]:
        """Return the mesh of the bent forearm.

        T_camera_palm (4, 4): palm frame to camera frame, metres.
        bend (3,): rotation vector of the wrist, radians, palm frame.
        Result (V, 3) twice: vertices in metres and outward unit normals, camera frame.
        """
        s, half_breadth, half_thickness = self._profile
        scale = self.shape.scale
        # The rotation is distributed over the wrist, from the palm's end to the straight part of the forearm.
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
        """Return the rings' positions, half breadths and half thicknesses (R,), metres.

        A position is the distance from the wrist, negative inside the palm.
        """
        scale = self.shape.scale
        wall = np.concatenate([np.linspace(-_INSIDE, _BEND_OVER, 10), np.linspace(_BEND_OVER, LENGTH, 11)[1:]])
        widths = PchipInterpolator(_PROFILE[:, 0] * LENGTH, _PROFILE[:, 1:])(wall)
        # Half an ellipsoid closes the elbow's end.
        cap = np.sin(np.linspace(0, np.pi / 2, _RINGS - len(wall) + 2)[1:-1])
        wall = np.concatenate([wall, LENGTH + 0.03 * cap])
        widths = np.concatenate([widths, widths[-1] * np.sqrt(1 - cap**2)[:, None]])
        half = widths * np.array([self.shape.wrist_breadth, self.shape.wrist_thickness]) / 2 * scale
        return wall * scale, half[:, 0], half[:, 1]

    def _centres(self, s: Array, turns: Array) -> Array:
        """Return the centre line (R, 3) in the palm frame, integrated from the rings' directions."""
        down = -turns[:, :, 1]
        steps = (down[1:] + down[:-1]) / 2 * np.diff(s)[:, None]
        start = self.shape.wrist + np.array([0, -s[0], 0])
        return np.concatenate([start[None], start + np.cumsum(steps, axis=0)])
