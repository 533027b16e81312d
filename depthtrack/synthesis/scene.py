"""What stands before the camera in a frame: the hand, its forearm, and whatever is behind them."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from depthtrack.geometry.camera import Camera
from depthtrack.hand.compiled_kinematics import BODY_COUNT
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.primitives import Primitives
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.mesh import Skin
from depthtrack.rendering.hand_surface import HandDrawer, PrimitiveHand, SkinHand
from depthtrack.rendering.rendered_surface import RenderedSurface
from depthtrack.rendering.triangles import rasterise
from depthtrack.synthesis.backdrop import FOREARM, Backdrop
from depthtrack.synthesis.forearm import Forearm
from depthtrack.types import Array, Mask

HandKind = Literal["primitives", "skin"]


@dataclass(frozen=True)
class View:
    """A rendered frame: the surface, and T_camera_body (17, 4, 4) of the 16 bodies and the forearm."""

    surface: RenderedSurface
    transforms: Array


@dataclass(frozen=True)
class Scene:
    """Renders the hand of given sizes, with or without forearm, before a backdrop that stays."""

    shape: HandShape
    kind: HandKind
    has_forearm: bool
    camera: Camera
    backdrop: Backdrop

    def view(self, pose: Array, elbow: Array) -> View:
        """The scene with the hand in `pose` (27,) and its forearm pointing at `elbow` (3,), camera frame."""
        still = self.backdrop.surface
        surface = RenderedSurface(still.depth.copy(), still.label.copy(), still.normal.copy())
        transforms = np.empty((BODY_COUNT + 1, 4, 4))
        transforms[:BODY_COUNT] = self.model.transforms(pose)
        self._hand.draw(self.camera, transforms[:BODY_COUNT], surface)
        bend = self._forearm.bend(transforms[0], elbow)
        transforms[FOREARM] = self._forearm.frame(transforms[0], bend)
        if self.has_forearm:
            vertices, normals = self._forearm.mesh(transforms[0], bend)
            faces = self._forearm.faces
            rasterise(self.camera, vertices, faces, normals, np.full(len(faces), FOREARM), surface)
        return View(surface, transforms)

    def hand_mask(self, view: View) -> Mask:
        """Pixels (h, w) of a view that see the hand, up to the wrist: the plane across the palm through
        `HandShape.wrist`.

        The forearm's tube begins inside the palm, and how much of it shows before the wrist depends on what the hand
        is drawn with. That stretch is hand too, so that hands of all kinds end at the same place.
        """
        label = view.surface.label
        hand = (label >= 0) & (label < BODY_COUNT)
        v, u = np.nonzero(label == FOREARM)
        points = self.camera.unproject(np.stack([u, v], axis=-1), view.surface.depth[v, u])
        T_camera_palm = view.transforms[0]
        towards_fingers = T_camera_palm[:3, 1]
        wrist = T_camera_palm[:3, :3] @ self.shape.wrist + T_camera_palm[:3, 3]
        hand[v, u] = (points - wrist) @ towards_fingers > 0
        return hand

    @cached_property
    def model(self) -> HandModel:
        """Kinematics of the hand."""
        return HandModel(self.shape)

    @cached_property
    def _hand(self) -> HandDrawer:
        return PrimitiveHand(Primitives.of(self.shape)) if self.kind == "primitives" else SkinHand(Skin.of(self.shape))

    @cached_property
    def _forearm(self) -> Forearm:
        return Forearm(self.shape)
