"""Drawing of a labelled capture: hands, rigid bodies, and markers with names."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.hand.pose import FINGERS, transformed
from depthtrack.hand.shape import HandShape
from depthtrack.markers.filled_capture import FilledCapture
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.rendering.hand_surface import HandSurface
from depthtrack.rendering.rendered_surface import RenderedSurface
from depthtrack.types import Array, Image, Mask
from depthtrack.viewing.marker_marks import (
    SUPERSAMPLING,
    NamedDot,
    draw_cross,
    draw_dot,
    draw_edges,
    draw_names,
    draw_offset,
)
from depthtrack.viewing.panels import blank, smaller
from depthtrack.viewing.shading import draw_surface
from depthtrack.viewing.theme import FINGER_COLOURS, OCCLUDER, PALM, SURFACE, Rgb

RIGID_COLOURS: tuple[Rgb, ...] = (OCCLUDER, (250, 204, 21), (45, 212, 191), (244, 114, 182))
"""Colours of rigid bodies, again from the first after the last."""
_OPACITY = 0.6
UNLABELLED_COLOUR: Rgb = (251, 146, 60)
_BEHIND = 0.012
"""Depth of a marker below the drawn skin from which it is hidden, metres."""


@dataclass(frozen=True)
class View:
    """A camera in the capture frame.

    T_camera_capture: (4, 4) metres.
    """

    camera: Camera
    T_camera_capture: Array

    def points(self, points: Array) -> Array:
        """Return points (..., 3) of the capture frame in the camera frame, metres."""
        return np.asarray(points @ self.T_camera_capture[:3, :3].T + self.T_camera_capture[:3, 3])

    def resized(self, factor: float) -> Self:
        """Return the view for pictures of another size."""
        return replace(self, camera=self.camera.resized(factor))


@dataclass(frozen=True, eq=False)
class MarkerScene:
    """A labelled capture to draw.

    positions: (T, M, 3) of each model, measured or filled, metres; NaN if neither.
    """

    labelled: LabelledCapture
    positions: tuple[Array, ...]

    @classmethod
    def of(cls, labelled: LabelledCapture) -> Self:
        """Return the scene of the measured markers."""
        return cls(labelled, tuple(labelled.positions(k) for k in range(len(labelled.models))))

    @classmethod
    def of_filled(cls, filled: FilledCapture) -> Self:
        """Return the scene of the measured and filled markers."""
        return cls(replace(filled.labelled, poses=filled.poses), filled.positions)

    @cached_property
    def rest(self) -> Array:
        """Points (T, K, 3) without a label, metres; NaN where there is none."""
        return self.labelled.rest().positions

    @cached_property
    def surfaces(self) -> tuple[HandSurface | None, ...]:
        """The surface of each hand; None for a rigid body."""
        return tuple(None if model.hand is None else _surface(model.hand) for model in self.labelled.models)

    def draw(self, frame: int, view: View, named: int | None = None) -> Image:
        """Return a picture (h, w, 3) of a frame in a view.

        named: model whose markers are drawn alone, with their names; None for those of all models, without names.

        Filled dots are markers that were measured, rings those that the pose or the filling puts there. Crosses are
        points without a label.
        """
        fine = view.resized(SUPERSAMPLING)
        surface = self._rendered(frame, fine)
        image = draw_surface(blank(fine.camera.width, fine.camera.height, SURFACE), surface, _OPACITY)
        self._draw_rest(image, frame, fine)
        dots = self._draw_markers(image, frame, fine, surface, named)
        image = smaller(image, view.camera.width, view.camera.height)
        if named is not None:
            draw_names(image, dots[named])
        return image

    def _rendered(self, frame: int, view: View) -> RenderedSurface:
        """Return the nearest surface of all hands."""
        nearest = RenderedSurface.empty(view.camera)
        for surface, poses in zip(self.surfaces, self.labelled.poses, strict=True):
            if surface is None or not np.isfinite(poses[frame]).all():
                continue
            pose = transformed(poses[frame], view.T_camera_capture)
            if surface.model.keypoints(pose)[:, 2].min() > 0.02:
                surface.drawer.draw(view.camera, surface.model.transforms(pose), nearest)
        return nearest

    def _draw_rest(self, image: Image, frame: int, view: View) -> None:
        for pixel in _in_view(view.camera, view.points(self.rest[frame])):
            draw_cross(image, pixel, UNLABELLED_COLOUR)

    def _draw_markers(
        self, image: Image, frame: int, view: View, surface: RenderedSurface, named: int | None
    ) -> list[list[NamedDot]]:
        """Draw the markers; return those in the image of each model."""
        dots: list[list[NamedDot]] = [[] for _ in self.labelled.models]
        for k, model in enumerate(self.labelled.models):
            if named not in (None, k):
                continue
            expected = view.points(model.positions(self.labelled.poses[k][frame]))
            at = view.points(self.positions[k][frame])
            measured = self.labelled.columns[k][frame] >= 0
            shown = np.where(np.isfinite(at), at, expected)
            pixels, colours = view.camera.project(shown), self.colours(k)
            if model.is_rigid:
                draw_edges(image, pixels, colours[0])
            hidden = _hidden(shown, pixels, surface)
            for m, pixel in enumerate(pixels):
                if not np.isfinite(pixel).all():
                    continue
                draw_offset(image, pixel, view.camera.project(expected[m]), colours[m])
                draw_dot(image, pixel, colours[m], bool(measured[m]), bool(hidden[m]))
                if 0 <= pixel[0] < view.camera.width and 0 <= pixel[1] < view.camera.height:
                    dots[k].append(NamedDot(model.labels[m], pixel / SUPERSAMPLING, colours[m]))
        return dots

    def colours(self, k: int) -> list[Rgb]:
        """Return the colour of each marker of model k: that of its finger or rigid body."""
        model = self.labelled.models[k]
        if model.is_rigid:
            earlier = sum(other.is_rigid for other in self.labelled.models[:k])
            return [RIGID_COLOURS[earlier % len(RIGID_COLOURS)]] * len(model.labels)
        return [PALM if body == 0 else FINGER_COLOURS[FINGERS[(body - 1) // 3]] for body in model.bodies]


def _surface(hand: HandShape) -> HandSurface:
    """Return the skin of a hand, or its primitives if the sizes give none."""
    try:
        return HandSurface.of(hand, skin=True)
    except InputError:
        return HandSurface.of(hand, skin=False)


def _in_view(camera: Camera, points: Array) -> Array:
    pixels = camera.project(points)
    inside = (pixels >= 0) & (pixels < [camera.width, camera.height])
    return pixels[inside.all(axis=-1)]


def _hidden(points: Array, pixels: Array, surface: RenderedSurface) -> Mask:
    """Return which points (M, 3), camera frame, are behind the drawn hands."""
    height, width = surface.depth.shape
    out = np.zeros(len(points), dtype=np.bool_)
    for m, (x, y) in enumerate(pixels):
        if 0 <= x < width and 0 <= y < height:
            depth = surface.depth[int(y), int(x)]
            out[m] = 0 < depth < points[m, 2] - _BEHIND
    return out
