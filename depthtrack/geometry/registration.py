"""Registration of colour to depth: the colour of each depth pixel, seen by another camera.

A depth pixel has a colour if the colour camera sees its point: inside its image, and with no nearer surface before it.
Occlusion is found with a depth buffer of the colour camera.
"""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.distortion import Distortion, rays
from depthtrack.types import Array, Array32, Depth, Image

BEHIND = 0.02
"""Distance, metres, behind the nearest surface on a line of sight from which a point is hidden from the camera."""
FARTHEST = 1.0
"""Bound on the distance between the two cameras, metres."""
_TOLERANCE = 1e-3


class Registration:
    """Colour images registered to the depth images of another camera.

    depth: camera of the depth, without distortion.
    colour: camera of the colour images.
    T_colour_depth: (4, 4) rigid transform to the frame of the colour camera, metres.
    distortion: of the colour camera, None for none.

    Raises:
        InputError: if the transform is not rigid, or the cameras are far apart.
    """

    def __init__(
        self, depth: Camera, colour: Camera, T_colour_depth: Array, distortion: Distortion | None = None
    ) -> None:
        T = np.asarray(T_colour_depth, dtype=np.float64)
        if T.shape != (4, 4) or not np.allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), rtol=0, atol=_TOLERANCE):
            raise InputError("the transform from depth to colour must be rigid: a rotation and a translation in metres")
        if not np.linalg.norm(T[:3, 3]) <= FARTHEST:  # false for NaN
            apart = float(np.linalg.norm(T[:3, 3]))
            raise InputError(f"depth and colour cameras must be at most {FARTHEST:g} m apart, found {apart:g} m")
        self.depth, self.colour, self._distortion = depth, colour, distortion
        x, y = rays(depth)
        ones = np.ones(depth.shape)
        directions = np.stack([x * ones, y[:, None] * ones, ones])
        self._directions: Array32 = np.tensordot(T[:3, :3], directions, axes=1).astype(np.float32)
        self._offset = T[:3, 3].astype(np.float32)
        # A cell of the depth buffer is as large as a depth pixel in the colour image.
        self._cell = max(1, math.ceil(max(colour.fx / depth.fx, colour.fy / depth.fy)))

    def __call__(self, depth: Depth, colour: Image) -> Image:
        """Return the colour (h, w, 3) of each depth pixel; black where there is none.

        depth: (h, w) metres, 0 = none.
        colour: (H, W, 3) RGB of the colour camera.

        Raises:
            InputError: if an image has another size than its camera.
        """
        if depth.shape != self.depth.shape or colour.shape != (*self.colour.shape, 3):
            raise InputError(
                f"registration expects depth {self.depth.shape} and colour {self.colour.shape},"
                f" found {depth.shape} and {colour.shape[:2]}"
            )
        across, down, z = self._projected(depth)
        seen = self._visible(across, down, z)
        sampled = cv2.remap(colour, across, down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return np.where(seen[..., None], sampled, 0).astype(np.uint8)

    def _projected(self, depth: Depth) -> tuple[Array32, Array32, Array32]:
        """Return column, row and depth of each point in the colour camera; NaN without a reading."""
        points = self._directions * depth + self._offset[:, None, None]
        z = np.where((depth > 0) & (points[2] > 0), points[2], np.nan)
        x, y = points[0] / z, points[1] / z
        if self._distortion is not None:
            x, y = self._distortion.distort(x, y)
        camera = self.colour
        across, down = camera.fx * x + camera.cx, camera.fy * y + camera.cy
        return across.astype(np.float32), down.astype(np.float32), z.astype(np.float32)

    def _visible(self, across: Array32, down: Array32, z: Array32) -> NDArray[np.bool_]:
        """Return whether the colour camera sees each point."""
        camera, cell = self.colour, self._cell
        with np.errstate(invalid="ignore"):
            inside = (across >= -0.5) & (across <= camera.width - 0.5) & (down >= -0.5) & (down <= camera.height - 0.5)
        rows = ((down[inside] + 0.5) / cell).astype(np.intp)
        columns = ((across[inside] + 0.5) / cell).astype(np.intp)
        buffer = np.full((camera.height // cell + 1, camera.width // cell + 1), np.inf, dtype=np.float32)
        np.minimum.at(buffer, (rows, columns), z[inside])
        # A surface that faces the depth camera leaves gaps between its points: each point also covers the cells around.
        nearest = cv2.erode(buffer, np.ones((3, 3), dtype=np.uint8), borderValue=np.inf)
        visible = np.zeros(z.shape, dtype=np.bool_)
        visible[inside] = z[inside] <= nearest[rows, columns] + BEHIND
        return visible
