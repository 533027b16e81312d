"""The interactive viewer of a labelled capture: markers with names, hands and residuals."""

import importlib
from typing import Any

import numpy as np

from depthtrack.hand.skin.mesh import Skin
from depthtrack.rendering.hand_surface import SkinHand
from depthtrack.types import Array
from depthtrack.viewing.marker_pictures import whole_view
from depthtrack.viewing.marker_scene import UNLABELLED_COLOUR, MarkerScene
from depthtrack.viewing.rerun_stream import CAMERA, RerunStream
from depthtrack.viewing.rerun_viewer import bones
from depthtrack.viewing.shading import BODY_COLOURS
from depthtrack.viewing.theme import FINGER_COLOURS, TEXT

_RADIUS = 0.004
"""Radius of a marker, metres."""


class RerunMarkerViewer(RerunStream[int]):
    """Viewer of the frames of a labelled capture.

    Entities, all in the capture frame, metres:

    - `world/MODEL/markers`: measured and filled markers with their names.
    - `world/MODEL/body_N` and `world/MODEL/skeleton`: a hand, each body with its part of the skin.
    - `world/unlabelled`: points without a label.
    - `residual/MODEL`: root mean square distance of the markers from those of the pose, mm.
    """

    def __init__(self, scene: MarkerScene, name: str) -> None:
        """Prepare the stream.

        Raises:
            MissingExtraError: if rerun is not installed.
        """
        self._scene, self._view = scene, whole_view(scene)
        super().__init__(name, self._view.camera, 0.1, 10.0)
        labelled = scene.labelled
        self._residuals = [1000 * labelled.residuals(k) for k in range(len(labelled.models))]
        self._colours = [np.array(scene.colours(k), dtype=np.uint8) for k in range(len(labelled.models))]

    def log(self, item: int) -> None:
        """Send the frame of this index at its time."""
        rr, labelled = self._rr, self._scene.labelled
        self._stream.set_time("time", duration=float(labelled.capture.times[item]))
        self._stream.set_time("frame", sequence=labelled.capture.first_frame + item)
        for k, model in enumerate(labelled.models):
            points = self._scene.positions[k][item]
            known = np.isfinite(points).all(axis=1)
            names = [label for label, shown in zip(model.labels, known, strict=True) if shown]
            self._stream.log(
                f"world/{model.name}/markers",
                rr.Points3D(points[known], labels=names, colors=self._colours[k][known], radii=_RADIUS),
            )
            if not model.is_rigid:
                self._log_hand(k, item)
            apart = self._residuals[k][item]
            apart = apart[np.isfinite(apart)]
            value = rr.Scalars(float(np.sqrt(np.mean(apart**2)))) if len(apart) else None
            self._log_or_clear(f"residual/{model.name}", value)
        rest = self._scene.rest[item]
        rest = rest[np.isfinite(rest).all(axis=1)]
        self._stream.log("world/unlabelled", rr.Points3D(rest, colors=UNLABELLED_COLOUR, radii=_RADIUS))

    def _log_hand(self, k: int, frame: int) -> None:
        rr, model, pose = self._rr, self._scene.labelled.models[k], self._scene.labelled.poses[k][frame]
        posed = bool(np.isfinite(pose).all())
        keypoints = model.kinematics.keypoints(pose) if posed else None
        self._log_or_clear(f"world/{model.name}/skeleton", bones(rr.LineStrips3D, keypoints, 0.0015, FINGER_COLOURS))
        if not posed:
            # A body without size is invisible; to clear it would remove its static mesh too.
            for body in range(len(BODY_COLOURS)):
                self._stream.log(f"world/{model.name}/body_{body}", rr.Transform3D(scale=0.0))
            return
        for body, T in enumerate(model.kinematics.transforms(pose)):
            self._stream.log(f"world/{model.name}/body_{body}", rr.Transform3D(translation=T[:3, 3], mat3x3=T[:3, :3]))

    def _log_static(self) -> None:
        rr, T = self._rr, np.linalg.inv(self._view.T_camera_capture)
        self._stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        self._stream.log(CAMERA, rr.Transform3D(translation=T[:3, 3], mat3x3=T[:3, :3]), static=True)
        for k, (model, surface) in enumerate(zip(self._scene.labelled.models, self._scene.surfaces, strict=True)):
            colour = TEXT if not model.is_rigid else self._scene.colours(k)[0]
            series = rr.SeriesLines(colors=colour, names=f"{model.name}, mm")
            self._stream.log(f"residual/{model.name}", series, static=True)
            if surface is not None and isinstance(surface.drawer, SkinHand):
                self._log_skin(model.name, surface.drawer.skin)

    def _log_skin(self, name: str, skin: Skin) -> None:
        """Send the part of the skin of each body, in the frame of the body."""
        normals = skin.normals(skin.rest)
        for body, T in enumerate(skin.T_body_rest):
            faces = skin.faces[skin.face_bodies == body]
            used, numbers = np.unique(faces, return_inverse=True)
            mesh = self._rr.Mesh3D(
                vertex_positions=_moved(skin.rest[used], T),
                vertex_normals=normals[used] @ T[:3, :3].T,
                triangle_indices=numbers.reshape(-1, 3),
                albedo_factor=BODY_COLOURS[body],
            )
            self._stream.log(f"world/{name}/body_{body}", mesh, static=True)

    def _layout(self) -> Any:
        rrb = importlib.import_module("rerun.blueprint")
        names = [model.name for model in self._scene.labelled.models]
        views = [rrb.TimeSeriesView(origin=f"residual/{name}", name=f"residual of {name}, mm") for name in names]
        scene = rrb.Spatial3DView(
            origin="world",
            name="markers",
            eye_controls=rrb.EyeControls3D(**self._eye()),
        )
        content = rrb.Horizontal(scene, rrb.Vertical(*views), column_shares=[3, 1])
        return rrb.Blueprint(
            content,
            rrb.TimePanel(timeline="time"),
            rrb.BlueprintPanel(state="collapsed"),
            rrb.SelectionPanel(state="collapsed"),
        )

    def _eye(self) -> dict[str, Array]:
        """Return the eye of the virtual camera."""
        T = np.linalg.inv(self._view.T_camera_capture)
        distance = self._view.T_camera_capture[2, 3]
        target = T[:3, :3] @ [0, 0, max(float(distance), 0.3)] + T[:3, 3]
        return {"position": T[:3, 3], "look_target": target, "eye_up": -T[:3, 1]}


def _moved(points: Array, T: Array) -> Array:
    return np.asarray(points @ T[:3, :3].T + T[:3, 3])
