"""Scene rendering: hand, forearm and held object in front of a static backdrop."""

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
from depthtrack.synthesis.held_object import HeldObject
from depthtrack.types import Array, Mask

HandKind = Literal["primitives", "skin"]


@dataclass(frozen=True)
class RenderedView:
    """A rendered frame.

    surface: depth, normals and labels of the visible surface, camera frame.
    transforms (17, 4, 4): T_camera_body of the 16 bodies and the forearm, metres.
    """

    surface: RenderedSurface
    transforms: Array


@dataclass(frozen=True)
class Scene:
    """A hand of given sizes, with or without forearm and object, before a static backdrop."""

    shape: HandShape
    kind: HandKind
    has_forearm: bool
    camera: Camera
    backdrop: Backdrop
    held: HeldObject | None = None

    def render(self, pose: Array, elbow: Array) -> RenderedView:
        """Render the scene.

        pose (27,): hand pose, camera frame.
        elbow (3,): point that the forearm is directed to, metres, camera frame.
        """
        background = self.backdrop.surface
        surface = RenderedSurface(background.depth.copy(), background.label.copy(), background.normal.copy())
        transforms = np.empty((BODY_COUNT + 1, 4, 4))
        transforms[:BODY_COUNT] = self.model.transforms(pose)
        self._hand.draw(self.camera, transforms[:BODY_COUNT], surface)
        bend = self._forearm.bend(transforms[0], elbow)
        transforms[FOREARM] = self._forearm.frame(transforms[0], bend)
        if self.has_forearm:
            vertices, normals = self._forearm.mesh(transforms[0], bend)
            faces = self._forearm.faces
            rasterise(self.camera, vertices, faces, normals, np.full(len(faces), FOREARM), surface)
        if self.held is not None:
            self.held.draw(self.camera, transforms[0], surface)
        return RenderedView(surface, transforms)

    def hand_mask(self, rendered: RenderedView) -> Mask:
        """Return the visible hand (h, w) up to the plane through `HandShape.wrist` across the palm.

        The forearm's mesh begins inside the palm, and its visible part before the wrist depends on the hand model.
        That part counts as hand, so that masks of all hand models end at the same plane.
        """
        label = rendered.surface.label
        hand = (label >= 0) & (label < BODY_COUNT)
        at = np.flatnonzero(label == FOREARM)
        points = self.camera.unproject_rows(at, rendered.surface.depth)
        T_camera_palm = rendered.transforms[0]
        towards_fingers = T_camera_palm[:3, 1]
        wrist = T_camera_palm[:3, :3] @ self.shape.wrist + T_camera_palm[:3, 3]
        hand.reshape(-1)[at] = (points - wrist) @ towards_fingers > 0
        return hand

    @cached_property
    def model(self) -> HandModel:
        """Return the kinematics of the hand."""
        return HandModel(self.shape)

    @cached_property
    def _hand(self) -> HandDrawer:
        return PrimitiveHand(Primitives.of(self.shape)) if self.kind == "primitives" else SkinHand(Skin.of(self.shape))

    @cached_property
    def _forearm(self) -> Forearm:
        return Forearm(self.shape)
