"""Close-up overlays of all trackers' poses on a frame, side by side."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from depthtrack.evaluation.compare.results import figures_of
from depthtrack.evaluation.evaluate import Evaluation
from depthtrack.evaluation.replay import Replay
from depthtrack.geometry.camera import Camera
from depthtrack.geometry.rectangle import Rect
from depthtrack.hand.kinematics import HandModel
from depthtrack.recording.sequence import Frame
from depthtrack.recording.status import Status
from depthtrack.rendering.rendered_surface import RenderedSurface
from depthtrack.report.colours import tracker_colour
from depthtrack.report.series import TrackerSeries
from depthtrack.types import Array, Image, Mask
from depthtrack.viewing.annotated_frame import AnnotatedFrame, true_keypoints
from depthtrack.viewing.close_ups import close_up_regions
from depthtrack.viewing.depth_colours import keypoint_depth_range
from depthtrack.viewing.overlay import FINGER_BONES, PALM_BONES, draw_skeleton
from depthtrack.viewing.panels import captioned, draw_layer, tile_grid
from depthtrack.viewing.shading import draw_surface
from depthtrack.viewing.theme import Rgb

_TRUE: Rgb = (255, 255, 255)
_SIDE_MARGIN = 1.15
"""Half the width of a region, relative to the hand's largest horizontal distance from its middle."""
_MOST_BESIDE = 3
"""Panels in one row; more are arranged in two rows."""


@dataclass(frozen=True)
class _Panel:
    """A tracker's run with its rows by frame index and the metric of its caption."""

    series: TrackerSeries
    replay: Replay
    row_of: dict[int, int]
    values: Array
    unit: str


class SideBySide:
    """Images of a recording's frames with the first run of every tracker, in one crop."""

    def __init__(
        self, series: Sequence[TrackerSeries], metric: str, height: int = 300, sequence: Path | None = None
    ) -> None:
        """Open the recording; captions show `metric`.

        height: of a panel, pixels.
        sequence: the recording's present path, if it was moved.
        Raises: InputError if the recording cannot be opened.
        """
        self._height = height
        self._panels = [_panel(each, metric, sequence) for each in series]
        self._surfaces = [panel.replay.surface() for panel in self._panels]
        self.sequence = self._panels[0].replay.sequence
        self.indices = sorted(set().union(*(panel.row_of for panel in self._panels)))
        keypoints = self._keypoints()
        known = np.asarray(np.isfinite(keypoints).all(axis=(1, 2)), dtype=np.bool_)
        regions = _narrowed(
            close_up_regions(self.sequence.camera, keypoints, known), self.sequence.camera, keypoints, known
        )
        self._regions = dict(zip(self.indices, regions, strict=True))
        self._range = keypoint_depth_range(keypoints[known], margin=0.1)

    def picture(self, frame: Frame) -> Image:
        """Return all trackers' panels of a frame (h, w, 3), each with its tracker's name and error."""
        tiles = [self._tile(k, frame) for k in range(len(self._panels))]
        return tile_grid(tiles, columns=len(tiles) if len(tiles) <= _MOST_BESIDE else -(-len(tiles) // 2))

    def _tile(self, k: int, frame: Frame) -> Image:
        panel, row = self._panels[k], self._panels[k].row_of.get(frame.index)
        status = None if row is None else panel.replay.run.status[row]
        note = "not tracked" if status is None else "" if status.is_trusted else status
        value = np.nan if row is None else panel.values[row]
        error = f"{value:.1f} {panel.unit}".strip() if np.isfinite(value) else ""
        remark = "  ·  ".join(filter(None, (error, note)))
        colour = tracker_colour(panel.series.number).rgb
        close = AnnotatedFrame(frame).cropped(self._regions[frame.index])
        image = draw_layer(close, "colour", self._height, *self._range)
        pose = None if row is None else panel.replay.camera_poses[row]
        if pose is not None and np.isfinite(pose).all():
            camera = close.camera.resized(self._height / close.camera.height)
            surface = self._surfaces[k].render(pose, camera)
            image = _outlined(draw_surface(image, surface, 0.35), surface, colour)
            image = self._with_truth(image, close)
            image = draw_skeleton(image, camera, self._surfaces[k].model.keypoints(pose))
        return captioned(image, panel.series.label, remark, colour)

    def _with_truth(self, image: Image, close: AnnotatedFrame) -> Image:
        """Draw the true skeleton in thin white lines, below the tracker's skeleton."""
        truth = true_keypoints(self.sequence, close.frame.timestamp)
        if truth is None:
            return image
        camera = close.camera.resized(self._height / close.camera.height)
        pixels = camera.project(truth)
        out = image.copy()
        for a, b in (*PALM_BONES, *(bone for bones in FINGER_BONES.values() for bone in bones)):
            if np.isfinite(pixels[[a, b]]).all():
                ends = np.rint(pixels[[a, b]].clip(-9999, 9999)).astype(int)
                cv2.line(out, tuple(ends[0]), tuple(ends[1]), _TRUE, 1, cv2.LINE_AA)
        return out

    def _keypoints(self) -> Array:
        """Return the keypoints (N, 21, 3), metres, camera frame, of `indices`.

        They are ground truth if known, else the median of the trackers, else NaN.
        """
        found = np.full((len(self.indices), len(self._panels) + 1, 21, 3), np.nan)
        times = self.sequence.timestamps
        for n, index in enumerate(self.indices):
            truth = true_keypoints(self.sequence, float(times[index]))
            if truth is not None and np.isfinite(truth).all():
                found[n, :] = truth
        row_of = {index: n for n, index in enumerate(self.indices)}
        without_truth = np.isnan(found[:, -1, 0, 0])
        for k, panel in enumerate(self._panels):
            run = panel.replay.run
            keypoints = HandModel(panel.replay.hand).keypoints(panel.replay.camera_poses)
            keypoints[[status is Status.LOST for status in run.status]] = np.nan
            rows = np.array([row_of[int(index)] for index in run.index], dtype=np.intp)
            found[rows, k] = np.where(without_truth[rows, None, None], keypoints, found[rows, k])
        out = np.full((len(self.indices), 21, 3), np.nan)
        known = np.isfinite(found).all(axis=(2, 3))
        some = known.any(axis=1)
        out[some] = np.nanmedian(np.where(known[some][..., None, None], found[some], np.nan), axis=1)
        return out


def _panel(series: TrackerSeries, metric: str, sequence: Path | None) -> _Panel:
    evaluation: Evaluation = series.result.evaluations[0]
    replay = Replay.open(evaluation.run, sequence)
    found = figures_of(evaluation).get(metric)
    values = np.full(evaluation.frames, np.nan) if found is None else found.values
    unit = "" if found is None else found.unit
    return _Panel(series, replay, {int(index): row for row, index in enumerate(evaluation.run.index)}, values, unit)


def _narrowed(regions: list[Rect], camera: Camera, keypoints: Array, known: Mask) -> list[Rect]:
    """Crop the empty margins at both sides of the regions, to a square at most."""
    height, width = regions[0].shape
    if not known.any() or width <= height:
        return regions
    middles = np.array([region.left + width / 2 for region in regions])
    extent = np.abs(camera.project(keypoints[known])[..., 0] - middles[known, None]).max(axis=1)
    narrow = min(width, max(height, round(2 * _SIDE_MARGIN * float(np.percentile(extent, 98)))))
    return [Rect.of_size(region.left + (width - narrow) // 2, region.top, narrow, height) for region in regions]


def _outlined(image: Image, surface: RenderedSurface, colour: Rgb) -> Image:
    """Draw the outline of a rendered surface in a colour."""
    hit = (surface.label >= 0).astype(np.uint8)
    rim = cv2.dilate(hit, np.ones((3, 3), dtype=np.uint8)) - cv2.erode(hit, np.ones((3, 3), dtype=np.uint8))
    out = image.copy()
    out[rim > 0] = colour
    return out
