"""Pictures of a run's frames: recording, hypothesis, residual, skeleton and timeline."""

from dataclasses import replace
from typing import Literal

import cv2
import numpy as np

from depthtrack.evaluation.replay import Replay, ReplayedFrame
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.hand.kinematics import HandModel
from depthtrack.rendering.rendered_surface import RenderedSurface
from depthtrack.types import Image, Mask
from depthtrack.viewing.annotated_frame import AnnotatedFrame, true_keypoints
from depthtrack.viewing.close_ups import close_up_regions
from depthtrack.viewing.depth_colours import keypoint_depth_range
from depthtrack.viewing.overlay import dimmed, draw_skeleton, faded_fingers
from depthtrack.viewing.panels import blank, captioned, draw_layer, draw_occluder, stacked, tile_grid
from depthtrack.viewing.residual_colours import LARGEST, enlarged, residual_scale, residual_to_rgb
from depthtrack.viewing.shading import draw_surface
from depthtrack.viewing.text import put_text, text_width
from depthtrack.viewing.theme import FAINT_TEXT, FINGER_TRUTH, OUTLINE, STATUS_COLOURS, TEXT
from depthtrack.viewing.timeline import Timeline

RunLayer = Literal["recording", "overlay", "hypothesis", "residual", "skeleton"]
LAYERS: tuple[RunLayer, ...] = ("recording", "hypothesis", "residual", "skeleton")
"""Views of `RunPainter.picture`."""
LAYERS_WITHOUT_DEPTH: tuple[RunLayer, ...] = ("hypothesis", "skeleton")
"""Those of a recording without depth images."""


class RunPainter:
    """Pictures of one run's frames in one size and colour scale; a view is `height` pixels high."""

    def __init__(self, replay: Replay, height: int = 360) -> None:
        camera = replay.sequence.camera
        self._replay, self._surface, self._height = replay, replay.surface(), height
        keypoints = HandModel(replay.hand).keypoints(replay.camera_poses)
        self._regions = close_up_regions(camera, keypoints, _trusted(replay))
        self._near, self._far = hand_depth_range(replay)
        self._scene_near, self._scene_far = hand_depth_range(replay, margin=0.5)
        self._layers = LAYERS if replay.sequence.has_depth else LAYERS_WITHOUT_DEPTH
        self._timeline: Timeline | None = None

    def picture(self, replayed: ReplayedFrame) -> Image:
        """Return all views of a frame (h, w, 3) with status, energy and timeline."""
        views = {layer: self.view(replayed, layer) for layer in self._layers}
        if "residual" in views:
            _draw_scale(views["residual"])
        tiles = [captioned(view, *self._caption(replayed, layer)) for layer, view in views.items()]
        grid = tile_grid(tiles, columns=2)
        if self._timeline is None:
            self._timeline = Timeline(self._replay.run.energy, self._replay.run.status, grid.shape[1])
        return stacked([self._headline(replayed, grid.shape[1]), grid, self._timeline.with_cursor(replayed.row)])

    def view(self, replayed: ReplayedFrame, layer: RunLayer) -> Image:
        """Return one view (height, w, 3) without a caption.

        "recording" shows the whole image, all others a close-up of the hand. "recording" and "overlay" show the
        hypothesis over the colour image, or over depth without colour.
        """
        annotated = annotated_run_frame(replayed, self._surface.model)
        close = annotated.cropped(self._regions[replayed.row])
        if layer == "recording":
            image = self._overlay(replayed, annotated, self._scene_near, self._scene_far)
            _draw_frame(image, self._regions[replayed.row], self._height / annotated.camera.height)
        elif layer == "overlay":
            image = self._overlay(replayed, close, self._near, self._far)
        elif layer == "hypothesis":
            image = self._hypothesis(replayed, close)
        elif layer == "residual":
            image = self._residual(replayed, close)
        else:
            image = self._skeleton(replayed, close)
        return _of_width(image, annotated.camera.resized(self._height / annotated.camera.height).width)

    def _overlay(self, replayed: ReplayedFrame, annotated: AnnotatedFrame, near: float, far: float) -> Image:
        image, surface = (
            draw_layer(annotated, "colour", self._height, near, far),
            self._rendered(replayed, annotated.camera),
        )
        return draw_occluder(image if surface is None else draw_surface(image, surface, 0.6), annotated)

    def _hypothesis(self, replayed: ReplayedFrame, close: AnnotatedFrame) -> Image:
        image, surface = (
            draw_layer(close, "depth", self._height, self._near, self._far),
            self._rendered(replayed, close.camera),
        )
        return image if surface is None else draw_surface(image, surface, 0.7)

    def _residual(self, replayed: ReplayedFrame, close: AnnotatedFrame) -> Image:
        camera, surface = (
            close.camera.resized(self._height / close.camera.height),
            self._rendered(replayed, close.camera),
        )
        size = camera.width, camera.height
        rendered = np.zeros(camera.shape) if surface is None else surface.depth
        observed = None if close.mask is None else enlarged(close.mask.astype(np.float32), *size) > 0
        return draw_occluder(residual_to_rgb(enlarged(close.frame.depth, *size), rendered, observed), close)

    def _skeleton(self, replayed: ReplayedFrame, close: AnnotatedFrame) -> Image:
        camera = close.camera.resized(self._height / close.camera.height)
        image = dimmed(draw_layer(close, "colour", self._height, self._near, self._far), 0.6)
        image = draw_occluder(image, close)
        truth = true_keypoints(self._replay.sequence, replayed.frame.timestamp)
        if truth is not None:
            image = draw_skeleton(image, camera, truth, thickness=1, colours=FINGER_TRUTH)
        if close.keypoints is None:
            return image
        return draw_skeleton(image, camera, close.keypoints, colours=faded_fingers(replayed.estimate.visibility))

    def _rendered(self, replayed: ReplayedFrame, camera: Camera) -> RenderedSurface | None:
        """Return the rendered hypothesis for a view of this camera."""
        if replayed.estimate.pose is None:
            return None
        return self._surface.render(replayed.estimate.pose, camera.resized(self._height / camera.height))

    def _caption(self, replayed: ReplayedFrame, layer: RunLayer) -> tuple[str, str]:
        if layer == "recording":
            return "recording", f"frame {replayed.frame.index}  ·  {replayed.frame.timestamp:.2f} s"
        if layer == "hypothesis":
            name = "hypothesis over depth" if self._replay.sequence.has_depth else "hypothesis"
            return name, "" if replayed.estimate.pose is not None else "no pose"
        if layer == "residual":
            observation = replayed.observation
            with_object = observation is not None and observation.occluder is not None
            rest = "green object" if with_object else "magenta not covered"
            return "residual", f"red nearer, blue farther, {rest}"
        truth = true_keypoints(self._replay.sequence, replayed.frame.timestamp)
        return "skeleton", "grey: hidden" if truth is None else "grey: hidden, thin: ground truth"

    def _headline(self, replayed: ReplayedFrame, width: int) -> Image:
        bar, estimate = blank(width, 34), replayed.estimate
        tracker = str(self._replay.run.configuration.get("tracker", "track"))[:20]
        put_text(bar, f"{self._replay.sequence.name[:40]}  ·  {tracker}", (4, 17), 20)
        values = f"energy {estimate.energy:.2f}"
        if np.isfinite(estimate.agreement):
            values += f"  ·  agreement {estimate.agreement:.2f}"
        if np.isfinite(estimate.confidence):
            values += f"  ·  confidence {100 * estimate.confidence:.0f} %"
        values = "" if estimate.pose is None else values
        x = width - 4 - text_width(values, 15)
        put_text(bar, values, (x, 17), 15, FAINT_TEXT)
        status = estimate.status
        put_text(bar, status, (x - 16 - text_width(status, 17), 17), 17, STATUS_COLOURS[status])
        return bar


def annotated_run_frame(replayed: ReplayedFrame, model: HandModel) -> AnnotatedFrame:
    """Return the frame with its observed silhouette and tracked keypoints."""
    annotated = AnnotatedFrame(replayed.frame)
    if replayed.observation is not None:
        observation, shape = replayed.observation, replayed.frame.camera.shape
        annotated = replace(annotated, mask=observation.whole_mask(shape), occluder=observation.whole_occluder(shape))
    if replayed.estimate.pose is not None:
        annotated = replace(annotated, keypoints=model.keypoints(replayed.estimate.pose))
    return annotated


def hand_depth_range(replay: Replay, margin: float = 0.06) -> tuple[float, float]:
    """Return near and far (metres) of the tracked hand, with `margin` metres behind it."""
    return keypoint_depth_range(HandModel(replay.hand).keypoints(replay.camera_poses[_trusted(replay)]), margin)


def _trusted(replay: Replay) -> Mask:
    return np.array([status.is_trusted for status in replay.run.status], dtype=np.bool_)


def _of_width(image: Image, width: int) -> Image:
    """Crop or pad an image to `width`: the aspect ratio of close-ups is rounded."""
    missing = width - image.shape[1]
    return image[:, :width] if missing <= 0 else np.pad(image, ((0, 0), (0, missing), (0, 0)), mode="edge")


def _draw_frame(image: Image, region: Rect, factor: float) -> None:
    """Draw the outline of a close-up region, in place."""
    left, top, right, bottom = region.scaled(factor)
    for colour, grow in ((OUTLINE, 1), (FAINT_TEXT, 0)):
        cv2.rectangle(image, (left - grow, top - grow), (right + grow - 1, bottom + grow - 1), colour)


def _draw_scale(image: Image) -> None:
    """Draw the residual's scale in the lower left corner, in place."""
    height, width = image.shape[:2]
    scale = residual_scale(min(120, width // 3), 8)
    y, x = height - 16, 8
    if y > 0:
        image[y : y + 8, x : x + scale.shape[1]] = scale
        label = f"{-1000 * LARGEST:.0f} to {1000 * LARGEST:.0f} mm"
        put_text(image, label, (x + scale.shape[1] + 8, y + 4), 13, TEXT)
