"""The interactive viewer: a recording on a time line, in 2D and 3D. Needs the extra `view` (rerun-sdk)."""

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
"""Pictures beside the depth image, which a 3D view would show twice."""


class MomentStream(RerunStream[Item]):
    """What viewers of recordings and of runs share: a frame with silhouette and keypoints.

    Entities: `world/camera` with colour, depth and its picture, mask and skeleton in pixels; `world/hand`, the points
    under the silhouette, and `world/skeleton`, the keypoints (metres, camera frame).
    """

    def log_moment(self, moment: AnnotatedFrame) -> None:
        """Show a moment at its time."""
        rr, stream = self._rr, self._stream
        stream.set_time("time", duration=moment.frame.timestamp)
        stream.set_time("frame", sequence=moment.frame.index)
        stream.log(f"{CAMERA}/depth", self._depth_image(moment))
        stream.log(f"{CAMERA}/depth_picture", jpeg(rr, depth_to_rgb(moment.frame.depth, *self._range), -9))
        colour = moment.frame.colour
        self._log_or_clear(f"{CAMERA}/colour", None if colour is None else jpeg(rr, colour, -8))
        self._log_or_clear(f"{CAMERA}/mask", _mask_image(rr, moment))
        self._log_or_clear("world/hand", self._hand_points(moment))
        keypoints = moment.keypoints
        in_pixels = None if keypoints is None else moment.camera.project(keypoints)
        self._log_or_clear("world/skeleton", bones(rr.LineStrips3D, keypoints, radius=0.0015))
        self._log_or_clear(f"{CAMERA}/skeleton", bones(rr.LineStrips2D, in_pixels, radius=1.8))

    def _depth_image(self, moment: AnnotatedFrame) -> Any:
        """Depth as a 16-bit PNG in the camera's own unit: a twentieth of the floats, and without loss."""
        rr, scale = self._rr, moment.camera.depth_scale
        units = np.clip(np.rint(moment.frame.depth / scale), 0, np.iinfo(np.uint16).max).astype(np.uint16)
        _, data = cv2.imencode(".png", units, [cv2.IMWRITE_PNG_COMPRESSION, 1])
        return rr.EncodedDepthImage(
            blob=data.tobytes(),
            media_type="image/png",
            meter=1 / scale,
            colormap=rr.components.Colormap.Inferno,
            # Turned round, because rerun paints the upper end bright, and in all our pictures the near end is. It
            # paints missing readings too, hence the depth picture over it; values can still be read off.
            depth_range=[self._range[1] / scale, self._range[0] / scale],
            point_fill_ratio=0.6,
        )

    def _hand_points(self, moment: AnnotatedFrame) -> Any | None:
        """The measured points under the silhouette, in the image's colours."""
        if moment.mask is None:
            return None
        depth = moment.frame.depth
        v, u = np.nonzero(moment.mask & (depth > 0))
        colours = moment.frame.colour if moment.frame.colour is not None else depth_to_rgb(depth, *self._range)
        points = moment.camera.unproject(np.stack([u, v], axis=-1), depth[v, u])
        # A pixel's width each, which covers the points of the depth image at the same places.
        radii = points[:, 2] / moment.camera.fx
        return self._rr.Points3D(points.astype(np.float32), colors=colours[v, u], radii=radii)

    def _scene(self, flat: Iterable[str]) -> Any:
        """The 3D view, from over the camera's shoulder to the nearest things, which the hand is among."""
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
        """A 2D view of what the camera sees: some of its entities over each other."""
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


class RerunViewer(MomentStream[AnnotatedFrame]):
    """Shows moments of a recording, its true skeleton and its mask."""

    def log(self, item: AnnotatedFrame) -> None:
        """See `RerunStream`."""
        self.log_moment(item)

    def _layout(self) -> Any:
        rrb = importlib.import_module("rerun.blueprint")
        images = rrb.Vertical(
            self._image("hand and true skeleton", "depth_picture", "colour", "mask", "skeleton"),
            self._image("depth", "depth", "depth_picture", "skeleton"),
        )
        return self._blueprint(rrb.Horizontal(self._scene(FLAT_IMAGES), images, column_shares=[3, 2]))


def jpeg(rr: Any, image: Image, draw_order: float) -> Any:
    """A picture over rerun's depth images (order -20) and under its masks (0)."""
    _, data = cv2.imencode(".jpg", np.ascontiguousarray(image[..., ::-1]), [cv2.IMWRITE_JPEG_QUALITY, 90])
    # Where one image lies on another, rerun makes it half clear unless told otherwise.
    return rr.EncodedImage(contents=data.tobytes(), media_type="image/jpeg", opacity=1, draw_order=draw_order)


def _mask_image(rr: Any, moment: AnnotatedFrame) -> Any | None:
    if moment.mask is None:
        return None
    label = TRUE_CLASS if moment.mask_is_true else ESTIMATED_CLASS
    return rr.SegmentationImage(moment.mask.astype(np.uint8) * np.uint8(label), opacity=0.4)


def bones(strips: Any, points: Array | None, radius: float, colours: dict[str, Rgb] = FINGER_COLOURS) -> Any | None:
    """Keypoints (21, 2 or 3) as line strips, coloured by finger; bones with an end that is unknown are left out."""
    if points is None:
        return None
    chains = [(bone, colours.get("palm", PALM)) for bone in PALM_BONES]
    chains += [(bone, colours[finger]) for finger, chain in FINGER_BONES.items() for bone in chain]
    known = [(bone, colour) for bone, colour in chains if np.isfinite(points[list(bone)]).all()]
    return strips([points[list(bone)] for bone, _ in known], colors=[colour for _, colour in known], radii=radius)
