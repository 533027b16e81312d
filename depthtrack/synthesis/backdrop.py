"""Static objects behind the hand: boxes, planes, ellipsoids and columns in plain colours.

The backdrop is fixed to the camera, so every viewpoint has a background. All coordinates are metres in the camera
frame.
"""

from dataclasses import dataclass
from itertools import product
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from depthtrack.geometry.camera import Camera
from depthtrack.hand.compiled_kinematics import BODY_COUNT
from depthtrack.hand.primitives import CYLINDER, SPHERE
from depthtrack.rendering.raycast import raycast
from depthtrack.rendering.rendered_surface import RenderedSurface
from depthtrack.rendering.triangles import rasterise
from depthtrack.synthesis.colour import linear_from_srgb, smooth_field
from depthtrack.types import Array

FOREARM = BODY_COUNT
"""Label of the forearm, after the 16 bodies of the hand."""
FACE = FOREARM + 1
"""Label of the bystander's face, which has the colour of skin."""
_CORNERS = np.array(list(product((0.0, 1.0), repeat=3)))
_BOX_FACES = np.array([int(corner) for corner in "130410032240173514571372642276654756"]).reshape(12, 3)
"""Corners of a unit cube and its triangles; trimesh, which makes the same, takes a third of a second to import."""
_AXES = [(-1, 0, 0), (0, -1, 0), (0, 0, -1), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
_BOX_NORMALS = np.array([_AXES[side] for side in (0, 1, 0, 2, 5, 1, 5, 4, 2, 4, 3, 3)], dtype=np.float64)


@dataclass
class Backdrop:
    """A rendered background: its visible surface and the colours of its objects.

    surface: depth, normals and one label an object, from FACE on.
    colours: one (3,) an object, linear RGB, in the order of the labels.
    """

    camera: Camera
    surface: RenderedSurface
    colours: list[Array]

    @classmethod
    def empty(cls, camera: Camera, face: Array) -> Self:
        """Return a backdrop without objects.

        face (3,): linear RGB of the bystander's face.
        """
        return cls(camera, RenderedSurface.empty(camera), [face])

    def albedo(self, rng: np.random.Generator) -> Array:
        """Return the reflectance of every pixel, with slight random variation.

        Result (h, w, 3): linear RGB; 0 without an object.
        """
        label = self.surface.label
        colours = np.concatenate([np.stack(self.colours), np.zeros((1, 3))])
        plain = colours[np.where(label >= FACE, label - FACE, -1)]
        return np.asarray(plain * (1 + 0.03 * smooth_field(label.shape, 25, rng))[..., None])

    def box(self, centre: ArrayLike, size: ArrayLike, turn: float, colour: tuple[int, int, int]) -> None:
        """Draw a box.

        centre (3,), size (3,): metres.
        turn: rotation about the vertical, radians.
        """
        R = Rotation.from_euler("y", turn).as_matrix()
        corners = (_CORNERS - 0.5) * np.asarray(size)
        vertices = corners[_BOX_FACES].reshape(-1, 3) @ R.T + np.asarray(centre)
        normals = np.repeat(_BOX_NORMALS @ R.T, 3, axis=0)
        faces = np.arange(len(vertices)).reshape(-1, 3)
        rasterise(self.camera, vertices, faces, normals, np.full(len(faces), self._label(colour)), self.surface)

    def plane(self, centre: ArrayLike, across: ArrayLike, along: ArrayLike, colour: tuple[int, int, int]) -> None:
        """Draw a rectangle.

        centre (3,): metres.
        across (3,), along (3,): half of its sides, metres.
        """
        c, a, b = (np.asarray(v, dtype=np.float64) for v in (centre, across, along))
        vertices = np.stack([c - a - b, c + a - b, c + a + b, c - a + b])
        normals = np.tile(np.cross(a, b), (4, 1))
        faces = np.array([[0, 1, 2], [0, 2, 3]])
        rasterise(self.camera, vertices, faces, normals, np.full(2, self._label(colour)), self.surface)

    def ellipsoid(self, centre: ArrayLike, radii: ArrayLike, colour: tuple[int, int, int] | None) -> None:
        """Draw an ellipsoid along the camera's axes; without a colour it is the face.

        centre (3,), radii (3,): metres.
        """
        T = np.diag([*np.asarray(radii, dtype=np.float64), 1.0])
        T[:3, 3] = centre
        self._raycast(SPHERE, T, FACE if colour is None else self._label(colour))

    def column(self, top: ArrayLike, height: float, radius: float, colour: tuple[int, int, int] | None) -> None:
        """Draw an upright cylinder with open ends; without a colour it is the face.

        top (3,): centre of its upper end, metres.
        height, radius: metres.
        """
        T = np.array([[radius, 0, 0, 0], [0, 0, height, 0], [0, -radius, 0, 0], [0, 0, 0, 1.0]])
        T[:3, 3] = top
        self._raycast(CYLINDER, T, FACE if colour is None else self._label(colour))

    def _raycast(self, kind: int, T: Array, label: int) -> None:
        raycast(self.camera, np.array([kind]), T[None], np.array([label]), self.surface)

    def _label(self, colour: tuple[int, int, int]) -> int:
        self.colours.append(linear_from_srgb(np.array(colour) / 255))
        return FACE + len(self.colours) - 1
