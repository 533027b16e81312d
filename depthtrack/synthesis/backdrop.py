"""What is behind the hand: things of plain shapes and colours that do not move.

It stays where it is relative to the camera, at every viewpoint: the camera walks around the hand, and behind the hand
there is always a room. Distances count from the nominal place of the hand.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
import trimesh
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
"""Label of the bystander's face: skin, but not the hand's."""


@dataclass
class Backdrop:
    """Things drawn so far: `surface` with a label for each, and their `colours` (3,), linear RGB, from FACE on."""

    camera: Camera
    surface: RenderedSurface
    colours: list[Array]

    @classmethod
    def empty(cls, camera: Camera, face: Array) -> Self:
        """Nothing yet; `face` (3,) is the colour that a face will have."""
        return cls(camera, RenderedSurface.empty(camera), [face])

    def albedo(self, rng: np.random.Generator) -> Array:
        """Linear RGB reflectance (h, w, 3), a little uneven as painted and woven things are; 0 where nothing is."""
        label = self.surface.label
        colours = np.concatenate([np.stack(self.colours), np.zeros((1, 3))])
        plain = colours[np.where(label >= FACE, label - FACE, -1)]
        return np.asarray(plain * (1 + 0.03 * smooth_field(label.shape, 25, rng))[..., None])

    def box(self, centre: ArrayLike, size: ArrayLike, turn: float, colour: tuple[int, int, int]) -> None:
        """A box of `size` (3,) metres at `centre` (3,), turned by `turn` radians about the vertical."""
        mesh = trimesh.creation.box(extents=np.asarray(size))
        R = Rotation.from_euler("y", turn).as_matrix()
        vertices = np.asarray(mesh.vertices)[mesh.faces].reshape(-1, 3) @ R.T + np.asarray(centre)
        normals = np.repeat(np.asarray(mesh.face_normals) @ R.T, 3, axis=0)
        faces = np.arange(len(vertices)).reshape(-1, 3)
        rasterise(self.camera, vertices, faces, normals, np.full(len(faces), self._label(colour)), self.surface)

    def plane(self, centre: ArrayLike, across: ArrayLike, along: ArrayLike, colour: tuple[int, int, int]) -> None:
        """A rectangle around `centre` (3,), reaching as far as `across` and `along` (3,) either way."""
        c, a, b = (np.asarray(v, dtype=np.float64) for v in (centre, across, along))
        vertices = np.stack([c - a - b, c + a - b, c + a + b, c - a + b])
        normals = np.tile(np.cross(a, b), (4, 1))
        faces = np.array([[0, 1, 2], [0, 2, 3]])
        rasterise(self.camera, vertices, faces, normals, np.full(2, self._label(colour)), self.surface)

    def ellipsoid(self, centre: ArrayLike, radii: ArrayLike, colour: tuple[int, int, int] | None) -> None:
        """An ellipsoid along the camera's axes; without colour, it is the face."""
        T = np.diag([*np.asarray(radii, dtype=np.float64), 1.0])
        T[:3, 3] = centre
        self._raycast(SPHERE, T, FACE if colour is None else self._label(colour))

    def column(self, top: ArrayLike, height: float, radius: float, colour: tuple[int, int, int] | None) -> None:
        """An upright cylinder that hangs down from `top` (3,), open at its ends; without colour, it is the face."""
        T = np.array([[radius, 0, 0, 0], [0, 0, height, 0], [0, -radius, 0, 0], [0, 0, 0, 1.0]])
        T[:3, 3] = top
        self._raycast(CYLINDER, T, FACE if colour is None else self._label(colour))

    def _raycast(self, kind: int, T: Array, label: int) -> None:
        raycast(self.camera, np.array([kind]), T[None], np.array([label]), self.surface)

    def _label(self, colour: tuple[int, int, int]) -> int:
        self.colours.append(linear_from_srgb(np.array(colour) / 255))
        return FACE + len(self.colours) - 1
