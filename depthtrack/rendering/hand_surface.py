"""The surface of the hand that a run fitted, seen through any camera."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from depthtrack.geometry.camera import Camera
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.primitives import Primitives
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.mesh import Skin
from depthtrack.rendering.surface import Surface
from depthtrack.synthesis.scene import DrawsHand, PrimitiveHand, SkinHand
from depthtrack.types import Array, Mask


@dataclass(frozen=True)
class ModelSurface:
    """A hand of spheres and cylinders, or of skin; `name` tells which."""

    name: str
    model: HandModel
    drawing: DrawsHand

    @classmethod
    def of(cls, shape: HandShape, skin: bool) -> Self:
        """The surface of a hand of these sizes. Raises InputError for sizes that no skin fits."""
        if skin:
            return cls("skin", HandModel(shape), SkinHand(Skin.of(shape)))
        return cls("cylinders", HandModel(shape), PrimitiveHand(Primitives.of(shape)))

    def seen(self, pose: Array, camera: Camera) -> Surface:
        """The surface of the hand in `pose` (27,) that `camera` sees, and nothing else; labels are bodies 0 to 15."""
        surface = Surface.empty(camera)
        self.drawing.draw(camera, self.model.transforms(pose), surface)
        return surface

    def silhouette(self, pose: Array, camera: Camera) -> Mask:
        """The pixels (h, w) that the hand in `pose` (27,) covers."""
        out = np.zeros(camera.shape, dtype=np.bool_)
        window = self.window(pose, camera)
        if window is not None:
            left, top, width, height = window
            out[top : top + height, left : left + width] = self.seen(pose, camera.crop(*window)).depth > 0
        return out

    def window(self, pose: Array, camera: Camera) -> tuple[int, int, int, int] | None:
        """(left, top, width, height) of the part of the image that the hand in `pose` may fall into; None outside."""
        points, shape = self.model.keypoints(pose), self.model.shape
        # No flesh is farther from the nearest keypoint than this.
        margin = shape.scale * max(shape.palm_breadth, shape.wrist_breadth, 2 * shape.radii.max()) / 2
        if points[:, 2].min() <= margin:
            return 0, 0, camera.width, camera.height
        # Flesh reaches nearer than the bones, where it looks larger.
        around = margin * np.array([camera.fx, camera.fy]) / (points[:, 2:].min() - margin)
        pixels = camera.project(points)
        low = np.clip(np.floor(pixels.min(axis=0) - around), 0, [camera.width, camera.height]).astype(int)
        high = np.clip(np.ceil(pixels.max(axis=0) + around) + 1, 0, [camera.width, camera.height]).astype(int)
        if (high <= low).any():
            return None
        return int(low[0]), int(low[1]), int(high[0] - low[0]), int(high[1] - low[1])
