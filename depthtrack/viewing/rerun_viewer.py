"""The interactive viewer of a recording: a time line with 2D and 3D views.

It needs the extra `view` (rerun-sdk).
"""

import importlib
from collections.abc import Iterable
from typing import Any

import cv2
import numpy as np

from depthtrack.types import Array, Image
from depthtrack.viewing.annotated_frame import AnnotatedFrame
from depthtrack.viewing.depth_colours import depth_to_rgb
from depthtrack.viewing.overlay import FINGER_BONES, PALM_BONES
from depthtrack.viewing.rerun_stream import CAMERA, ESTIMATED_CLASS, TRUE_CLASS, Item, RerunStream
from depthtrack.viewing.theme import FINGER_COLOURS, PALM, Rgb

FLAT_IMAGES = ("colour", "depth_picture", "mask", "skeleton")
"""Images that the 3D view excludes, since it shows the depth image already."""


class AnnotatedFrameStream(RerunStream[Item]):
    """Base of the viewers of recordings and of runs: a frame with silhouette and keypoints.

    Entities:

    - `world/camera`: colour, depth, depth picture, mask and skeleton, pixels.
    - `world/hand`: the depth points in the silhouette, metres, camera frame.
    - `world/skeleton`: the keypoints, metres, camera frame.
    """

    def log_annotated(self, annotated: AnnotatedFrame) -> None:
        """Send an annotated frame at its time."""
        rr, stream = self._rr, self._stream
        stream.set_time("time", duration=annotated.frame.timestamp)
        stream.set_time("frame", sequence=annotated.frame.index)
        stream.log(f"{CAMERA}/depth", self._depth_image(annotated))
        stream.log(f"{CAMERA}/depth_picture", jpeg(rr, depth_to_rgb(annotated.frame.depth, *self._range), -9))
        colour = annotated.frame.colour
        self._log_or_clear(f"{CAMERA}/colour", None if colour is None else jpeg(rr, colour, -8))
        self._log_or_clear(f"{CAMERA}/mask", _mask_image(rr, annotated))
        self._log_or_clear("world/hand", self._hand_points(annotated))
        keypoints = annotated.keypoints
        in_pixels = None if keypoints is None else annotated.camera.project(keypoints)
        self._log_or_clear("world/skeleton", bones(rr.LineStrips3D, keypoints, radius=0.0015))
        self._log_or_clear(f"{CAMERA}/skeleton", bones(rr.LineStrips2D, in_pixels, radius=1.8))

    def _depth_image(self, annotated: AnnotatedFrame) -> Any:
        """Return depth as a lossless 16-bit PNG in the camera's depth scale.

        It has 5 % of the floats' size.
        """
        rr, scale = self._rr, annotated.camera.depth_scale
        units = np.clip(np.rint(annotated.frame.depth / scale), 0, np.iinfo(np.uint16).max).astype(np.uint16)
        _, data = cv2.imencode(".png", units, [cv2.IMWRITE_PNG_COMPRESSION, 1])
        return rr.EncodedDepthImage(
            blob=data.tobytes(),
            media_type="image/png",
            meter=1 / scale,
            colormap=rr.components.Colormap.Inferno,
            # Reversed, since rerun draws the upper end bright and all our pictures the near end. Rerun also draws
            # missing readings, so the depth picture covers this image; its values remain readable.
            depth_range=[self._range[1] / scale, self._range[0] / scale],
            point_fill_ratio=0.6,
        )

    def _hand_points(self, annotated: AnnotatedFrame) -> Any | None:
        """Return the depth points in the silhouette with the image's colours."""
        if annotated.mask is None:
            return None
        depth = annotated.frame.depth
        v, u = np.nonzero(annotated.mask & (depth > 0))
        colours = annotated.frame.colour if annotated.frame.colour is not None else depth_to_rgb(depth, *self._range)
        points = annotated.camera.unproject(np.stack([u, v], axis=-1), depth[v, u])
        # A radius of one pixel covers the depth image's points at the same positions.
        radii = points[:, 2] / annotated.camera.fx
        return self._rr.Points3D(points.astype(np.float32), colors=colours[v, u], radii=radii)

    def _scene(self, flat: Iterable[str]) -> Any:
        """Return the 3D view, from behind the camera towards the near end of the depth range."""
        rrb = importlib.import_module("rerun.blueprint")
        return rrb.Spatial3DView(
            origin="world",
            name="scene",
            contents=["$origin/**", *(f"- {CAMERA}/{image}" for image in flat)],
            eye_controls=rrb.EyeControls3D(
                position=[0.25, -0.15, self._range[0] - 0.4],
                look_target=[0, 0, self._range[0] + 0.1],
                eye_up=[0, -1, 0],
            ),
        )

    def _image(self, name: str, *parts: str) -> Any:
        """Return a 2D view of the camera's entities, drawn over each other."""
        rrb = importlib.import_module("rerun.blueprint")
        return rrb.Spatial2DView(origin=CAMERA, name=name, contents=[f"$origin/{part}" for part in parts])

    def _blueprint(self, content: Any) -> Any:
        rrb = importlib.import_module("rerun.blueprint")
        return rrb.Blueprint(
            content,
            rrb.TimePanel(timeline="time"),
            rrb.BlueprintPanel(state="collapsed"),
            rrb.SelectionPanel(state="collapsed"),
        )


class RerunViewer(AnnotatedFrameStream[AnnotatedFrame]):
    """Viewer of a recording with true skeleton and mask."""

    def log(self, item: AnnotatedFrame) -> None:
        """See `RerunStream`."""
        self.log_annotated(item)

    def _layout(self) -> Any:
        rrb = importlib.import_module("rerun.blueprint")
        images = rrb.Vertical(
            self._image("hand and true skeleton", "depth_picture", "colour", "mask", "skeleton"),
            self._image("depth", "depth", "depth_picture", "skeleton"),
        )
        return self._blueprint(rrb.Horizontal(self._scene(FLAT_IMAGES), images, column_shares=[3, 2]))


def jpeg(rr: Any, image: Image, draw_order: float) -> Any:
    """Return an image between rerun's depth images (draw order -20) and its masks (0)."""
    _, data = cv2.imencode(".jpg", np.ascontiguousarray(image[..., ::-1]), [cv2.IMWRITE_JPEG_QUALITY, 90])
    # By default, rerun draws an image over another one half transparent.
    return rr.EncodedImage(contents=data.tobytes(), media_type="image/jpeg", opacity=1, draw_order=draw_order)


def _mask_image(rr: Any, annotated: AnnotatedFrame) -> Any | None:
    if annotated.mask is None:
        return None
    label = TRUE_CLASS if annotated.mask_is_true else ESTIMATED_CLASS
    return rr.SegmentationImage(annotated.mask.astype(np.uint8) * np.uint8(label), opacity=0.4)


def bones(strips: Any, points: Array | None, radius: float, colours: dict[str, Rgb] = FINGER_COLOURS) -> Any | None:
    """Return bones as line strips in the fingers' colours, without those of unknown keypoints.

    points (21, 2) or (21, 3): keypoints, pixels or metres; NaN if unknown.
    """
    if points is None:
        return None
    chains = [(bone, colours.get("palm", PALM)) for bone in PALM_BONES]
    chains += [(bone, colours[finger]) for finger, chain in FINGER_BONES.items() for bone in chain]
    known = [(bone, colour) for bone, colour in chains if np.isfinite(points[list(bone)]).all()]
    return strips([points[list(bone)] for bone, _ in known], colors=[colour for _, colour in known], radii=radius)
