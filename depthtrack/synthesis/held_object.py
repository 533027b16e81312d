"""An object in the hand: a sphere, a box or a cylinder that moves with the palm.

The object touches the palm. Fingers that would enter it are opened until they touch it.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, Self

import numpy as np

from depthtrack.geometry.camera import Camera
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import ANGLES, ORIENTATION, POSITION
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.shape import HandShape
from depthtrack.rendering.rendered_surface import RenderedSurface
from depthtrack.rendering.triangles import rasterise
from depthtrack.synthesis.colour import linear_from_srgb
from depthtrack.types import Array

HeldKind = Literal["none", "sphere", "box", "cylinder"]

HELD = 1000
"""Label of the object, beyond those of all others."""
_PROPORTIONS = {"sphere": (1.0, 1.0, 1.0), "box": (1.0, 0.75, 0.5), "cylinder": (2.2, 0.7, 0.7)}
"""Sides along the palm's axes, in multiples of the size; a cylinder lies across the palm."""
_ALONG_PALM = 0.25
"""Place of the object from the palm's centre towards the fingers, palm lengths."""
_SPREAD = 0.005
"""Standard deviation of that place, metres."""
_SOFT = 0.002
"""Metres by which skin yields."""
_HALVINGS = 8
"""Steps that find how far a finger closes, to a two hundredth of its way."""
_COLOURS = np.array([(40, 90, 200), (30, 140, 60), (20, 160, 170), (90, 60, 190), (210, 210, 215)])
"""Blue, green, teal, violet and white."""


@dataclass(frozen=True)
class HeldObject:
    """An object fixed to the palm.

    half: (3,) half of its sides, metres; a sphere and a cylinder have equal ones.
    centre: (3,) metres, palm frame.
    colour: (3,) linear RGB.
    """

    kind: HeldKind
    half: Array
    centre: Array
    colour: Array

    @classmethod
    def sample(cls, kind: HeldKind, size: float, hand: HandShape, rng: np.random.Generator) -> Self:
        """Return an object of a size (m) in a palm, at a random place in a random colour."""
        half = size / 2 * np.array(_PROPORTIONS[kind])
        x, y = rng.normal((0, _ALONG_PALM * hand.palm_length * hand.scale), _SPREAD)
        centre = np.array([x, y, hand.palm_thickness * hand.scale / 2 + half[2] - _SOFT])
        return cls(kind, half, centre, linear_from_srgb(rng.choice(_COLOURS) / 255))

    def distance(self, points: Array) -> Array:
        """Return the distance (...,) of points (..., 3) from the surface, negative inside.

        points: metres, palm frame.
        """
        offset = np.abs(points - self.centre)
        if self.kind == "sphere":
            return np.asarray(np.linalg.norm(offset, axis=-1) - self.half[0])
        if self.kind == "cylinder":
            across = np.linalg.norm(offset[..., 1:], axis=-1)
            beyond = np.stack([offset[..., 0] - self.half[0], across - self.half[1]], axis=-1)
        else:
            beyond = offset - self.half
        return np.asarray(np.linalg.norm(np.maximum(beyond, 0), axis=-1) + np.minimum(beyond.max(axis=-1), 0))

    def opened(self, poses: Array, hand: HandShape) -> Array:
        """Return poses (N, 27) whose fingers stop at the object.

        The angles of a finger that enters it move towards those of the open hand.
        """
        model, angles = HandModel(hand), poses[:, ANGLES].reshape(-1, 5, 4)
        still = np.zeros_like(poses)
        still[:, ORIENTATION], still[:, POSITION] = (1, 0, 0, 0), 0
        flat = POSTURES["open"].reshape(5, 4)
        low, high = np.zeros(angles.shape[:2]), np.ones(angles.shape[:2])
        for step in range(_HALVINGS + 1):
            share = high if step == 0 else (low + high) / 2
            still[:, ANGLES] = (flat + share[..., None] * (angles - flat)).reshape(-1, 20)
            free = self._clearance(still, model) >= -_SOFT
            low, high = np.where(free, share, low), np.where(free, high, share)
        out = poses.copy()
        out[:, ANGLES] = (flat + low[..., None] * (angles - flat)).reshape(-1, 20)
        return out

    def draw(self, camera: Camera, T_camera_palm: Array, onto: RenderedSurface) -> None:
        """Draw the object into `onto`.

        T_camera_palm: (4, 4) palm frame to camera frame, metres.
        """
        corners, normals = self._mesh
        R, t = T_camera_palm[:3, :3], T_camera_palm[:3, 3]
        faces = np.arange(len(corners)).reshape(-1, 3)
        rasterise(camera, corners @ R.T + t, faces, normals @ R.T, np.full(len(faces), HELD), onto)

    def _clearance(self, poses: Array, model: HandModel) -> Array:
        """Return the distance (N, 5) of each finger's skin from the object.

        poses: (N, 27), in the palm frame.

        The first half of the proximal phalanx, which belongs to the palm, is left out.
        """
        ends = model.endpoints(poses).reshape(-1, 5, 4, 3)
        radii = model.shape.radii * model.shape.scale
        share = np.linspace(0, 1, 5)[1:]
        points = ends[:, :, :-1, None] + share[:, None] * (ends[:, :, 1:, None] - ends[:, :, :-1, None])
        thick = radii[:, :-1, None] + share * (radii[:, 1:, None] - radii[:, :-1, None])
        clear = (self.distance(points) - thick).reshape(len(poses), 5, -1)
        # The tip's last bit is its rounded end.
        clear[:, :, -1] += radii[:, -1]
        return np.asarray(clear[:, :, 2:].min(axis=-1))

    @cached_property
    def _mesh(self) -> tuple[Array, Array]:
        """Corners and normals (3 F, 3) of the triangles, palm frame."""
        import trimesh

        if self.kind == "sphere":
            mesh = trimesh.creation.icosphere(subdivisions=4, radius=self.half[0])
        elif self.kind == "box":
            mesh = trimesh.creation.box(extents=2 * self.half)
        else:
            mesh = trimesh.creation.cylinder(radius=self.half[1], height=2 * self.half[0], sections=64)
        # A cylinder's axis z becomes x.
        order = [2, 0, 1] if self.kind == "cylinder" else [0, 1, 2]
        corners = np.asarray(mesh.vertices)[mesh.faces].reshape(-1, 3)[:, order] + self.centre
        return corners, np.repeat(np.asarray(mesh.face_normals)[:, order], 3, axis=0)
