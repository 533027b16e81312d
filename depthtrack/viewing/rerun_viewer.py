"""The interactive viewer: a recording on a time line, in 2D and 3D. Needs the extra `view` (rerun-sdk)."""

import importlib
import os
import shutil
import socket
import sysconfig
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from depthtrack.camera import Camera
from depthtrack.errors import InputError, MissingExtraError
from depthtrack.viewing.depth_colours import depth_to_rgb
from depthtrack.viewing.moments import Moment
from depthtrack.viewing.overlay import FINGER_BONES, PALM_BONES
from depthtrack.viewing.theme import ESTIMATED_MASK, FINGER_COLOURS, PALM, TRUE_MASK, Rgb

CAMERA = "world/camera"
TRUE_CLASS, ESTIMATED_CLASS = 1, 2
_FLAT_IMAGES = ("colour", "depth_picture", "mask", "skeleton")


class RerunViewer:
    """Sends moments to rerun. Choose one destination, `open_window`, `serve` or `save`, before the first `log`.

    Entities: `world/camera` with colour, depth and its picture, mask and skeleton in pixels; `world/hand`, the points
    under the silhouette, and `world/skeleton`, the true keypoints (metres, camera frame). Raises MissingExtraError
    without rerun.
    """

    def __init__(self, name: str, camera: Camera, near: float, far: float) -> None:
        self._rr = _rerun()
        self._stream = self._rr.RecordingStream("depthtrack", recording_id=None)
        self._stream.send_recording_name(name)
        self._range = near, far
        self._camera = camera

    def open_window(self) -> None:
        """Start rerun's own window, which goes on after this program ends. Raises InputError where it cannot start."""
        # The program beside this Python, which is on no PATH unless the virtual environment is activated.
        program = shutil.which("rerun", path=sysconfig.get_path("scripts"))
        try:
            self._rr.spawn(executable_path=program, recording=self._stream, default_blueprint=self._layout())
        except RuntimeError as error:
            reason = str(error).strip().partition("\n")[0]
            raise InputError(
                f"the viewer's window cannot start ({reason}): write an .rrd file or a contact sheet instead"
            ) from error
        self._log_static()

    def serve(self, open_browser: bool = True) -> str:
        """Serve the viewer to browsers while this process lives; returns its address.

        Rerun listens on every network interface: whoever reaches this machine's ports can look on.
        """
        port = _free_port(9090)
        source = self._stream.serve_grpc(grpc_port=_free_port(9876), default_blueprint=self._layout())
        self._rr.serve_web_viewer(web_port=port, open_browser=open_browser, connect_to=source)
        self._log_static()
        return f"http://localhost:{port}/?url={source}"

    def log(self, moment: Moment) -> None:
        """Show a moment at its time; what it does not know is cleared, so that nothing old stays on the screen."""
        rr, stream = self._rr, self._stream
        stream.set_time("time", duration=moment.frame.timestamp)
        stream.set_time("frame", sequence=moment.frame.index)
        stream.log(f"{CAMERA}/depth", self._depth_image(moment))
        stream.log(f"{CAMERA}/depth_picture", _jpeg(rr, depth_to_rgb(moment.frame.depth, *self._range), -9))
        colour = moment.frame.colour
        self._log_or_clear(f"{CAMERA}/colour", None if colour is None else _jpeg(rr, colour, -8))
        self._log_or_clear(f"{CAMERA}/mask", _mask_image(rr, moment))
        self._log_or_clear("world/hand", self._hand_points(moment))
        keypoints = moment.keypoints
        in_pixels = None if keypoints is None else moment.camera.project(keypoints)
        self._log_or_clear("world/skeleton", _bones(rr.LineStrips3D, keypoints, radius=0.0015))
        self._log_or_clear(f"{CAMERA}/skeleton", _bones(rr.LineStrips2D, in_pixels, radius=1.8))

    def close(self) -> None:
        """Wait until everything has been sent."""
        self._stream.flush()
        self._stream.disconnect()

    def save(self, path: Path, moments: Iterable[Moment]) -> int:
        """Write moments to an .rrd file, complete or not at all; returns how many. Raises InputError."""
        if path.suffix.lower() != ".rrd":
            raise InputError(f"a rerun recording must end in .rrd, found '{path.name}'")
        if not path.parent.is_dir():
            raise InputError(f"the folder {path.parent} for the recording does not exist: create it first")
        aside = path.with_name(f".{path.stem}.{os.getpid()}.rrd")
        count = 0
        try:
            try:
                self._stream.save(aside, default_blueprint=self._layout())
                self._log_static()
                for moment in moments:
                    self.log(moment)
                    count += 1
            finally:
                self.close()
            os.replace(aside, path)
        finally:
            aside.unlink(missing_ok=True)
        return count

    def _log_static(self) -> None:
        rr, camera = self._rr, self._camera
        self._stream.log("world", rr.ViewCoordinates.RDF, static=True)
        pinhole = rr.Pinhole(
            image_from_camera=camera.matrix,
            resolution=[camera.width, camera.height],
            camera_xyz=rr.ViewCoordinates.RDF,
            image_plane_distance=0.1,
        )
        self._stream.log(CAMERA, pinhole, static=True)
        classes = [
            rr.AnnotationInfo(id=0, color=(0, 0, 0, 0)),
            rr.AnnotationInfo(id=TRUE_CLASS, label="true mask", color=TRUE_MASK),
            rr.AnnotationInfo(id=ESTIMATED_CLASS, label="estimated mask", color=ESTIMATED_MASK),
        ]
        self._stream.log(CAMERA, rr.AnnotationContext(classes), static=True)

    def _layout(self) -> Any:
        rrb = importlib.import_module("rerun.blueprint")
        scene = rrb.Spatial3DView(
            origin="world",
            name="scene",
            contents=["$origin/**", *(f"- {CAMERA}/{image}" for image in _FLAT_IMAGES)],
            # From over the camera's shoulder to the nearest things, which the hand is among.
            eye_controls=rrb.EyeControls3D(
                position=[0.25, -0.15, self._range[0] - 0.4],
                look_target=[0, 0, self._range[0] + 0.1],
                eye_up=[0, -1, 0],
            ),
        )
        images = [
            rrb.Spatial2DView(origin=CAMERA, name=name, contents=[f"$origin/{part}" for part in parts])
            for name, parts in (
                ("hand and true skeleton", ("depth_picture", "colour", "mask", "skeleton")),
                ("depth", ("depth", "depth_picture", "skeleton")),
            )
        ]
        return rrb.Blueprint(
            rrb.Horizontal(scene, rrb.Vertical(*images), column_shares=[3, 2]),
            rrb.TimePanel(timeline="time"),
            rrb.BlueprintPanel(state="collapsed"),
            rrb.SelectionPanel(state="collapsed"),
        )

    def _depth_image(self, moment: Moment) -> Any:
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

    def _hand_points(self, moment: Moment) -> Any | None:
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

    def _log_or_clear(self, entity: str, content: Any | None) -> None:
        self._stream.log(entity, self._rr.Clear(recursive=False) if content is None else content)


def _free_port(usual: int) -> int:
    """The usual port, or any free one where it is taken: rerun only logs that it could not listen."""
    for port in (usual, 0):
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind(("", port))
            except OSError:
                continue
            return int(probe.getsockname()[1])
    raise InputError("the viewer cannot be served: no network port is free")


def _rerun() -> Any:
    try:
        return importlib.import_module("rerun")
    except ImportError as error:
        raise MissingExtraError("the interactive viewer", "view") from error


def _jpeg(rr: Any, image: NDArray[np.uint8], draw_order: float) -> Any:
    """A picture over rerun's depth images (order -20) and under its masks (0)."""
    _, data = cv2.imencode(".jpg", np.ascontiguousarray(image[..., ::-1]), [cv2.IMWRITE_JPEG_QUALITY, 90])
    return rr.EncodedImage(contents=data.tobytes(), media_type="image/jpeg", draw_order=draw_order)


def _mask_image(rr: Any, moment: Moment) -> Any | None:
    if moment.mask is None:
        return None
    label = TRUE_CLASS if moment.mask_is_true else ESTIMATED_CLASS
    return rr.SegmentationImage(moment.mask.astype(np.uint8) * np.uint8(label), opacity=0.4)


def _bones(strips: Any, points: NDArray[np.float64] | None, radius: float) -> Any | None:
    """Keypoints (21, 2 or 3) as coloured line strips; bones with an end that is unknown are left out."""
    if points is None:
        return None
    chains: list[tuple[tuple[int, int], Rgb]] = [(bone, PALM) for bone in PALM_BONES]
    chains += [(bone, FINGER_COLOURS[finger]) for finger, bones in FINGER_BONES.items() for bone in bones]
    known = [(bone, colour) for bone, colour in chains if np.isfinite(points[list(bone)]).all()]
    return strips([points[list(bone)] for bone, _ in known], colors=[colour for _, colour in known], radii=radius)
