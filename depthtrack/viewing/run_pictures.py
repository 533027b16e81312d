"""A frame of a run in one picture: recording, hypothesis over depth, residual, skeleton, and the run at a glance."""

from dataclasses import replace
from typing import Literal

import numpy as np

from depthtrack.evaluation.replay import Replay, ReplayedFrame
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.hand.kinematics import HandModel
from depthtrack.rendering.rendered_surface import RenderedSurface
from depthtrack.types import Image, Mask
from depthtrack.viewing.annotated_frame import AnnotatedFrame, true_keypoints
from depthtrack.viewing.close_ups import close_ups
from depthtrack.viewing.depth_colours import depth_range
from depthtrack.viewing.overlay import dimmed, draw_skeleton
from depthtrack.viewing.panels import blank, captioned, paint, stacked, tile_grid
from depthtrack.viewing.residual_colours import LARGEST, enlarged, residual_scale, residual_to_rgb
from depthtrack.viewing.shading import draw_surface
from depthtrack.viewing.text import put_text, text_width
from depthtrack.viewing.theme import FAINT_TEXT, FINGER_TRUTH, OUTLINE, STATUS_COLOURS, TEXT
from depthtrack.viewing.timeline import Timeline

RunLayer = Literal["recording", "overlay", "hypothesis", "residual", "skeleton"]
LAYERS: tuple[RunLayer, ...] = ("recording", "hypothesis", "residual", "skeleton")
"""The views of `RunPainter.picture`."""


class RunPainter:
    """Paints frames of one run, all in the same sizes and colours; `height` pixels of each view."""

    def __init__(self, replay: Replay, height: int = 360) -> None:
        run, camera = replay.run, replay.sequence.camera
        self._replay, self._surface, self._height = replay, replay.surface(), height
        keypoints = HandModel(replay.hand).keypoints(run.poses)
        self._regions = close_ups(camera, keypoints, _trusted(replay))
        self._near, self._far = hand_range(replay)
        self._scene_near, self._scene_far = hand_range(replay, room=0.5)
        self._timeline: Timeline | None = None

    def picture(self, seen: ReplayedFrame) -> Image:
        """All four views of a frame, what the tracker said of it, and its place in the run."""
        views = {layer: self.view(seen, layer) for layer in LAYERS}
        _draw_scale(views["residual"])
        tiles = [captioned(view, *self._caption(seen, layer)) for layer, view in views.items()]
        grid = tile_grid(tiles, columns=2)
        if self._timeline is None:
            self._timeline = Timeline(self._replay.run.energy, self._replay.run.status, grid.shape[1])
        return stacked([self._headline(seen, grid.shape[1]), grid, self._timeline.at(seen.row)])

    def view(self, seen: ReplayedFrame, layer: RunLayer) -> Image:
        """One view (height, w, 3), without a caption: of the whole image for "recording", else close on the hand.

        "recording" and "overlay" show the hypothesis over the colour image, where there is one.
        """
        moment = run_moment(seen, self._surface.model)
        close = moment.cropped(self._regions[seen.row])
        if layer == "recording":
            image = self._overlay(seen, moment, self._scene_near, self._scene_far)
            _draw_frame(image, self._regions[seen.row], self._height / moment.camera.height)
        elif layer == "overlay":
            image = self._overlay(seen, close, self._near, self._far)
        elif layer == "hypothesis":
            image = self._hypothesis(seen, close)
        elif layer == "residual":
            image = self._residual(seen, close)
        else:
            image = self._skeleton(seen, close)
        return _of_width(image, moment.camera.resized(self._height / moment.camera.height).width)

    def _overlay(self, seen: ReplayedFrame, moment: AnnotatedFrame, near: float, far: float) -> Image:
        image, surface = paint(moment, "colour", self._height, near, far), self._rendered(seen, moment.camera)
        return image if surface is None else draw_surface(image, surface, 0.6)

    def _hypothesis(self, seen: ReplayedFrame, close: AnnotatedFrame) -> Image:
        image, surface = paint(close, "depth", self._height, self._near, self._far), self._rendered(seen, close.camera)
        return image if surface is None else draw_surface(image, surface, 0.7)

    def _residual(self, seen: ReplayedFrame, close: AnnotatedFrame) -> Image:
        camera, surface = close.camera.resized(self._height / close.camera.height), self._rendered(seen, close.camera)
        size = camera.width, camera.height
        rendered = np.zeros(camera.shape) if surface is None else surface.depth
        observed = None if close.mask is None else enlarged(close.mask.astype(np.float32), *size) > 0
        return residual_to_rgb(enlarged(close.frame.depth, *size), rendered, observed)

    def _skeleton(self, seen: ReplayedFrame, close: AnnotatedFrame) -> Image:
        camera = close.camera.resized(self._height / close.camera.height)
        image = dimmed(paint(close, "colour", self._height, self._near, self._far), 0.6)
        truth = true_keypoints(self._replay.sequence.ground_truth, seen.frame.timestamp)
        if truth is not None:
            image = draw_skeleton(image, camera, truth, thickness=1, colours=FINGER_TRUTH)
        return image if close.keypoints is None else draw_skeleton(image, camera, close.keypoints)

    def _rendered(self, seen: ReplayedFrame, camera: Camera) -> RenderedSurface | None:
        """The hypothesis as a view of this camera shows it."""
        if seen.estimate.pose is None:
            return None
        return self._surface.render(seen.estimate.pose, camera.resized(self._height / camera.height))

    def _caption(self, seen: ReplayedFrame, layer: RunLayer) -> tuple[str, str]:
        if layer == "recording":
            return "recording", f"frame {seen.frame.index}  ·  {seen.frame.timestamp:.2f} s"
        if layer == "hypothesis":
            return "hypothesis over depth", "" if seen.estimate.pose is not None else "no pose"
        if layer == "residual":
            return "residual", "nearer red, farther blue, unexplained magenta"
        truth = true_keypoints(self._replay.sequence.ground_truth, seen.frame.timestamp)
        return "skeleton", "" if truth is None else "the true one thin"

    def _headline(self, seen: ReplayedFrame, width: int) -> Image:
        bar, estimate = blank(width, 34), seen.estimate
        tracker = str(self._replay.run.configuration.get("tracker", "track"))[:20]
        put_text(bar, f"{self._replay.sequence.name[:40]}  ·  {tracker}", (4, 17), 20)
        told = "" if estimate.pose is None else f"energy {estimate.energy:.2f}  ·  confidence {estimate.confidence:.2f}"
        x = width - 4 - text_width(told, 15)
        put_text(bar, told, (x, 17), 15, FAINT_TEXT)
        status = estimate.status
        put_text(bar, status, (x - 16 - text_width(status, 17), 17), 17, STATUS_COLOURS[status])
        return bar


def run_moment(seen: ReplayedFrame, model: HandModel) -> AnnotatedFrame:
    """The frame with the observed silhouette and the tracked keypoints."""
    moment = AnnotatedFrame(seen.frame)
    if seen.observation is not None:
        moment = replace(moment, mask=seen.observation.whole_mask(seen.frame.camera.shape))
    if seen.estimate.pose is not None:
        moment = replace(moment, keypoints=model.keypoints(seen.estimate.pose))
    return moment


def hand_range(replay: Replay, room: float = 0.06) -> tuple[float, float]:
    """Near and far (metres) that give the hand of a run most of the colours, with `room` metres behind it."""
    depths = HandModel(replay.hand).keypoints(replay.run.poses[_trusted(replay)])[..., 2]
    if depths.size == 0:
        return 0.3, 1.5
    near, far = depth_range(depths.astype(np.float32), (1.0, 99.0))
    return max(near - 0.06, 0.05), far + room


def _trusted(replay: Replay) -> Mask:
    return np.array([status.is_trusted for status in replay.run.status], dtype=np.bool_)


def _of_width(image: Image, width: int) -> Image:
    """`image` without, or with, the last few columns: close-ups have the whole image's shape but for rounding."""
    missing = width - image.shape[1]
    return image[:, :width] if missing <= 0 else np.pad(image, ((0, 0), (0, missing), (0, 0)), mode="edge")


def _draw_frame(image: Image, region: Rect, factor: float) -> None:
    """The outline of a close-up, in place."""
    left, top, right, bottom = region.scaled(factor)
    height, width = image.shape[:2]
    for colour, grow in ((OUTLINE, 1), (FAINT_TEXT, 0)):
        rows = slice(max(top - grow, 0), max(bottom + grow, 0))
        columns = slice(max(left - grow, 0), max(right + grow, 0))
        for x in (left - grow, right + grow - 1):
            if 0 <= x < width:
                image[rows, x] = colour
        for y in (top - grow, bottom + grow - 1):
            if 0 <= y < height:
                image[y, columns] = colour


def _draw_scale(image: Image) -> None:
    """The scale of the residual in the lower left corner, in place."""
    height, width = image.shape[:2]
    scale = residual_scale(min(120, width // 3), 8)
    y, x = height - 16, 8
    if y > 0:
        image[y : y + 8, x : x + scale.shape[1]] = scale
        label = f"{-1000 * LARGEST:.0f} to {1000 * LARGEST:.0f} mm"
        put_text(image, label, (x + scale.shape[1] + 8, y + 4), 13, TEXT)
