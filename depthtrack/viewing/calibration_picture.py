"""Calibration picture: the hand before and after calibration over the observed depth."""

from collections.abc import Sequence

import cv2
import numpy as np

from depthtrack.calibration.calibrate import Calibration
from depthtrack.calibration.rig_calibration import RigCalibration
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.hand.shape import HandShape
from depthtrack.hand.skin.mesh import Skin
from depthtrack.rendering.rendered_surface import RenderedSurface
from depthtrack.rendering.triangles import rasterise
from depthtrack.segmentation.observation import Observation
from depthtrack.types import Array, Image, Mask
from depthtrack.viewing.contact_sheet import framed
from depthtrack.viewing.depth_colours import depth_to_rgb
from depthtrack.viewing.overlay import dimmed
from depthtrack.viewing.panels import beside, captioned, stacked
from depthtrack.viewing.shading import draw_surface
from depthtrack.viewing.theme import BACKGROUND, TRUE_MASK

_HEIGHT = 300
_ROWS = 4
_OPACITY = 0.75


def calibration_picture(calibration: Calibration | RigCalibration, before: HandShape | None = None) -> Image:
    """Return a page of views: depth, the hand before calibration and the calibrated hand.

    The outline of the observed silhouette is drawn on both.

    before: the rig at its own scale; None for the average hand.
    Result (h, w, 3): RGB.
    """
    first = HandShape(side=calibration.hand.side) if before is None else before
    name_before = "average hand" if before is None else "rig as given"
    rows = []
    for i in shown_views(calibration.observations):
        o = calibration.observations[i]
        camera = o.camera.crop(_square(o.camera.shape)).resized(_HEIGHT / max(o.camera.shape))
        background, outline = _background(o, camera)
        tiles = [captioned(background, f"frame {o.frame_index}", "depth")]
        for name, hand, pose in (
            (name_before, first, calibration.poses_before[i]),
            ("measured hand", calibration.hand, calibration.poses[i]),
        ):
            drawn = draw_surface(dimmed(background, 0.8), _rendered(hand, pose, camera), _OPACITY)
            drawn[outline] = TRUE_MASK
            tiles.append(captioned(drawn, name))
        rows.append(beside(tiles))
    return framed(stacked(rows))


def shown_views(observations: Sequence[Observation]) -> list[int]:
    """Return the indices of the shown observations, in the order of the recording."""
    chosen = np.unique(np.linspace(0, len(observations) - 1, _ROWS).round().astype(int)).tolist()
    return sorted(chosen, key=lambda i: observations[i].frame_index)


def _square(shape: tuple[int, int]) -> Rect:
    """Return the square around an image of `shape` (height, width), for pictures of one size."""
    side = max(shape)
    return Rect.of_size((shape[1] - side) // 2, (shape[0] - side) // 2, side, side)


def _background(o: Observation, camera: Camera) -> tuple[Image, Mask]:
    """Return the observed depth in colours (h, w, 3) and the silhouette's outline (h, w)."""
    square = _square(o.camera.shape)
    depth, silhouette = square.crop(o.depth), square.crop(o.silhouette.astype(np.uint8))
    size = (camera.width, camera.height)
    large = cv2.resize(silhouette, size, interpolation=cv2.INTER_NEAREST)
    readings = depth[depth > 0]
    near, far = (float(readings.min()), float(readings.max()) + 0.05) if readings.size else (0.3, 1.0)
    image = depth_to_rgb(np.asarray(cv2.resize(depth, size, interpolation=cv2.INTER_NEAREST)), near, far)
    image[large == 0] = BACKGROUND
    return image, (large > 0) & (cv2.erode(large, np.ones((3, 3), np.uint8)) == 0)


def _rendered(hand: HandShape, pose: Array, camera: Camera) -> RenderedSurface:
    skin = Skin.of(hand)
    vertices = skin.at(pose)
    return rasterise(camera, vertices, skin.faces, skin.normals(vertices), skin.face_bodies)
