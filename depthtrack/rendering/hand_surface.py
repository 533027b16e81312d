"""Rendering of a posed hand, made of primitives or a skin mesh."""

from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np

from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.primitives import Primitives
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.mesh import Skin
from depthtrack.rendering.raycast import raycast
from depthtrack.rendering.rendered_surface import RenderedSurface
from depthtrack.rendering.triangles import rasterise
from depthtrack.types import Array, Mask


class HandDrawer(Protocol):
    """Draws a posed hand."""

    def draw(self, camera: Camera, transforms: Array, onto: RenderedSurface) -> None:
        """Draw the hand into `onto`, labelled by body, 0 to 15.

        transforms (16, 4, 4): T_camera_body, metres.
        """
        ...


@dataclass(frozen=True)
class PrimitiveHand:
    """Draws the hand of spheres and cylinders."""

    primitives: Primitives

    def draw(self, camera: Camera, transforms: Array, onto: RenderedSurface) -> None:
        raycast(camera, self.primitives.kinds, self.primitives.transforms(transforms), self.primitives.bodies, onto)


@dataclass(frozen=True)
class SkinHand:
    """Draws the skinned mesh."""

    skin: Skin

    def draw(self, camera: Camera, transforms: Array, onto: RenderedSurface) -> None:
        vertices = self.skin.vertices(transforms)
        rasterise(camera, vertices, self.skin.faces, self.skin.normals(vertices), self.skin.face_bodies, onto)


@dataclass(frozen=True)
class HandSurface:
    """A hand and its drawer; `name` is "cylinders" or "skin"."""

    name: str
    model: HandModel
    drawer: HandDrawer

    @classmethod
    def of(cls, shape: HandShape, skin: bool) -> Self:
        """Return the surface of a hand: its skin mesh, or its primitives.

        Raises:
            InputError: if the sizes give no closed skin.
        """
        if skin:
            return cls("skin", HandModel(shape), SkinHand(Skin.of(shape)))
        return cls("cylinders", HandModel(shape), PrimitiveHand(Primitives.of(shape)))

    def render(self, pose: Array, camera: Camera) -> RenderedSurface:
        """Return the hand rendered for `camera`; labels are bodies 0 to 15.

        pose (27,): metres, quaternion and radians, camera frame.
        """
        surface = RenderedSurface.empty(camera)
        self.drawer.draw(camera, self.model.transforms(pose), surface)
        return surface

    def silhouette(self, pose: Array, camera: Camera) -> Mask:
        """Return the pixels (h, w) that the hand covers.

        pose (27,): metres, quaternion and radians, camera frame.
        """
        region = self.bounds(pose, camera)
        if region.is_empty:
            return np.zeros(camera.shape, dtype=np.bool_)
        return region.paste(self.render(pose, camera.crop(region)).depth > 0, camera.rect)

    def bounds(self, pose: Array, camera: Camera) -> Rect:
        """Return the part of the image that the hand may cover, empty if the hand lies outside.

        pose (27,): metres, quaternion and radians, camera frame.
        """
        points, shape = self.model.keypoints(pose), self.model.shape
        # No point of the surface is farther from the nearest keypoint.
        margin = shape.scale * max(shape.palm_breadth, shape.wrist_breadth, 2 * shape.radii.max()) / 2
        if points[:, 2].min() <= margin:
            return camera.rect
        # The surface is nearer to the camera than the keypoints, where its image is larger.
        around = margin * np.array([camera.fx, camera.fy]) / (points[:, 2:].min() - margin)
        return Rect.around(camera.project(points), around).clipped(camera.rect)
