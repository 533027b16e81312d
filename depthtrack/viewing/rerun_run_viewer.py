"""The interactive viewer of a run: hypothesis, residual, skeleton and energy on a time line."""

import importlib
from typing import Any

import cv2
import numpy as np

from depthtrack.evaluation.evaluate import evaluate
from depthtrack.evaluation.replay import Replay, ReplayedFrame
from depthtrack.rendering.rendered_surface import RenderedSurface
from depthtrack.viewing.annotated_frame import true_keypoints
from depthtrack.viewing.rerun_stream import CAMERA
from depthtrack.viewing.rerun_viewer import FLAT_IMAGES, AnnotatedFrameStream, bones, jpeg
from depthtrack.viewing.residual_colours import residual_to_rgb
from depthtrack.viewing.run_pictures import annotated_run_frame, hand_depth_range
from depthtrack.viewing.shading import BODY_COLOURS, draw_surface
from depthtrack.viewing.theme import FINGER_TRUTH, STATUS_COLOURS

_OPACITY = 170
_HAND_IMAGES = ("hypothesis", "residual", "true_skeleton")
_SERIES = {"energy": (167, 110, 230), "agreement": (56, 189, 248), "error_mm": (251, 191, 36)}


class RerunRunViewer(AnnotatedFrameStream[ReplayedFrame]):
    """Viewer of a replayed run.

    Entities, in addition to those of recordings:

    - `world/hypothesis`: the tracked hand's visible surface, metres, camera frame.
    - `world/camera/hypothesis` and `world/camera/residual`: images.
    - `world/true_skeleton`: true keypoints, if known.
    - `run/energy`, `run/agreement`, `run/error_mm` and `run/status`: values over time.
    """

    def __init__(self, replay: Replay) -> None:
        near, far = hand_depth_range(replay)
        super().__init__(
            f"{replay.run.folder.resolve().name} on {replay.sequence.name}", replay.sequence.camera, near, far
        )
        self._surface, self._sequence = replay.surface(), replay.sequence
        points = evaluate(replay, residuals=False).points
        self._error = None if points is None else points.mean().values

    def log(self, item: ReplayedFrame) -> None:
        """See `RerunStream`."""
        rr, stream, estimate, frame = self._rr, self._stream, item.estimate, item.frame
        annotated = annotated_run_frame(item, self._surface.model)
        self.log_annotated(annotated)
        surface = None if estimate.pose is None else self._surface.render(estimate.pose, frame.camera)
        self._log_or_clear(f"{CAMERA}/hypothesis", None if surface is None else _picture(rr, surface))
        rendered = np.zeros(frame.camera.shape) if surface is None else surface.depth
        stream.log(f"{CAMERA}/residual", jpeg(rr, residual_to_rgb(frame.depth, rendered, annotated.mask), -7))
        self._log_or_clear("world/hypothesis", None if surface is None else self._points(surface))
        truth = true_keypoints(self._sequence, frame.timestamp)
        in_pixels = None if truth is None else frame.camera.project(truth)
        self._log_or_clear("world/true_skeleton", bones(rr.LineStrips3D, truth, 0.0008, FINGER_TRUTH))
        self._log_or_clear(f"{CAMERA}/true_skeleton", bones(rr.LineStrips2D, in_pixels, 0.8, FINGER_TRUTH))
        self._log_numbers(item)

    def _log_numbers(self, item: ReplayedFrame) -> None:
        rr, stream, estimate = self._rr, self._stream, item.estimate
        values = {"energy": estimate.energy, "agreement": estimate.agreement}
        if self._error is not None:
            values["error_mm"] = float(self._error[item.row])
        for name, value in values.items():
            self._log_or_clear(f"run/{name}", rr.Scalars(value) if np.isfinite(value) else None)
        status = estimate.status
        stream.log("run/status", rr.TextLog(f"frame {item.frame.index}: {status}", color=STATUS_COLOURS[status]))

    def _points(self, surface: RenderedSurface) -> Any:
        """Return every second pixel of the visible surface as points in the fingers' colours."""
        depth, label = surface.depth[::2, ::2], surface.label[::2, ::2]
        v, u = np.nonzero(label >= 0)
        points = self._camera.unproject(2 * np.stack([u, v], axis=-1), depth[v, u])
        colours = BODY_COLOURS[label[v, u]]
        return self._rr.Points3D(points.astype(np.float32), colors=colours, radii=points[:, 2] / self._camera.fx)

    def _log_static(self) -> None:
        super()._log_static()
        for name, colour in _SERIES.items():
            self._stream.log(f"run/{name}", self._rr.SeriesLines(colors=colour, names=name), static=True)

    def _layout(self) -> Any:
        rrb = importlib.import_module("rerun.blueprint")
        series = [
            rrb.TimeSeriesView(origin=f"run/{name}", name=title)
            for name, title in (("energy", "energy"), ("error_mm", "error, mm"), ("agreement", "agreement"))
            if name != "error_mm" or self._error is not None
        ]
        images = rrb.Vertical(
            self._image("hypothesis", "depth_picture", "colour", "hypothesis", "skeleton", "true_skeleton"),
            self._image("residual, to 20 mm: red nearer, blue farther", "depth_picture", "residual"),
        )
        scene = self._scene((*FLAT_IMAGES, *_HAND_IMAGES))
        numbers = rrb.Vertical(*series, rrb.TextLogView(origin="run/status", name="status"))
        return self._blueprint(rrb.Horizontal(scene, images, numbers, column_shares=[3, 3, 2]))


def _picture(rr: Any, surface: RenderedSurface) -> Any:
    """Return the hypothesis as an image that is transparent outside the hand."""
    image = draw_surface(np.zeros((*surface.depth.shape, 3), dtype=np.uint8), surface)
    alpha = np.where(surface.label >= 0, _OPACITY, 0).astype(np.uint8)
    _, data = cv2.imencode(".png", np.dstack([image[..., ::-1], alpha]), [cv2.IMWRITE_PNG_COMPRESSION, 3])
    return rr.EncodedImage(contents=data.tobytes(), media_type="image/png", opacity=1, draw_order=-6)
