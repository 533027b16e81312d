"""The picture of a labelled scene: all models, and each alone with its names."""

from collections.abc import Sequence

import numpy as np

from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.markers.virtual_camera import virtual_camera
from depthtrack.types import Array, Image
from depthtrack.viewing.contact_sheet import framed
from depthtrack.viewing.marker_marks import draw_legend
from depthtrack.viewing.marker_scene import UNLABELLED_COLOUR, MarkerScene, View
from depthtrack.viewing.panels import blank, captioned, stacked, tile_grid
from depthtrack.viewing.text import put_text, text_width
from depthtrack.viewing.theme import FAINT_TEXT, FINGER_COLOURS


def scene_picture(scene: MarkerScene, frame: int, title: str) -> Image:
    """Return a page (h, w, 3) with a frame of a labelled capture.

    title: name of the capture.
    """
    labelled = scene.labelled
    tiles = []
    if len(labelled.models) > 1:
        tiles.append(captioned(scene.draw(frame, whole_view(scene, frame)), "all models"))
    for k, model in enumerate(labelled.models):
        view = model_view(scene, k, frame)
        measured = int((labelled.columns[k][frame] >= 0).sum())
        remark = f"{measured} of {len(model.labels)} markers measured{_residual_text(labelled, k, frame)}"
        tiles.append(captioned(scene.draw(frame, view, named=k), model.name, remark))
    grid = tile_grid(tiles, min(2, len(tiles)))
    unlabelled = int(np.isfinite(scene.rest[frame]).all(axis=-1).sum())
    number = labelled.capture.first_frame + frame
    subtitle = f"frame {number}  ·  {labelled.capture.times[frame]:.3f} s  ·  {unlabelled} points without a label"
    return framed(stacked([_headline(title, subtitle, grid.shape[1]), grid, _legend(grid.shape[1])], gap=10))


def marker_sheet(scene: MarkerScene, frames: Sequence[int], title: str, columns: int = 4, width: int = 400) -> Image:
    """Return a page of frames of a labelled capture in reading order, all in one view.

    width: of a picture, pixels.
    """
    capture, view = scene.labelled.capture, whole_view(scene)
    small = view.resized(width / view.camera.width)
    tiles = [
        captioned(
            scene.draw(frame, small),
            f"frame {capture.first_frame + frame}",
            f"{capture.times[frame]:.2f} s  ·  {_count_text(scene.labelled, frame)}",
        )
        for frame in frames
    ]
    grid = tile_grid(tiles, min(columns, len(tiles)))
    subtitle = f"{len(capture)} frames, {capture.rate:g} Hz"
    return framed(stacked([_headline(title, subtitle, grid.shape[1]), grid, _legend(grid.shape[1])], gap=10))


def _count_text(labelled: LabelledCapture, frame: int) -> str:
    measured = sum(int((columns[frame] >= 0).sum()) for columns in labelled.columns)
    return f"{measured} of {sum(len(model.labels) for model in labelled.models)} markers"


def fullest_frame(labelled: LabelledCapture) -> int:
    """Return the frame with the most poses, and among those with the most labelled markers."""
    count = sum((columns >= 0).sum(axis=1) for columns in labelled.columns)
    posed = sum(np.isfinite(poses).all(axis=1).astype(int) for poses in labelled.poses)
    return int(np.lexsort((np.arange(len(labelled.capture)), -np.asarray(count), -np.asarray(posed)))[0])


def whole_view(scene: MarkerScene, frame: int | None = None) -> View:
    """Return a view of all models in a frame, or in all frames.

    It faces the back of the first hand.
    """
    labelled, part = scene.labelled, slice(None) if frame is None else slice(frame, frame + 1)
    points = [_extent(scene, k, part) for k in range(len(labelled.models))]
    hands = [k for k, model in enumerate(labelled.models) if not model.is_rigid] or [0]
    return View(*virtual_camera(labelled.poses[hands[0]][part], np.concatenate(points)))


def model_view(scene: MarkerScene, k: int, frame: int) -> View:
    """Return a close view of model k in a frame."""
    part = slice(frame, frame + 1)
    return View(*virtual_camera(scene.labelled.poses[k][part], _extent(scene, k, part)))


def _extent(scene: MarkerScene, k: int, part: slice) -> Array:
    """Return the points (N, 3) that a view of model k must show, metres."""
    model, poses = scene.labelled.models[k], scene.labelled.poses[k][part]
    points = [scene.positions[k][part].reshape(-1, 3), model.positions(poses).reshape(-1, 3)]
    if not model.is_rigid:
        points.append(model.kinematics.keypoints(poses).reshape(-1, 3))
    return np.concatenate(points)


def _residual_text(labelled: LabelledCapture, k: int, frame: int) -> str:
    apart = labelled.residuals(k)[frame]
    known = apart[np.isfinite(apart)]
    return f", {1000 * float(np.sqrt(np.mean(known**2))):.1f} mm from the pose" if len(known) else ""


def _headline(title: str, subtitle: str, width: int) -> Image:
    bar = blank(width, 34)
    put_text(bar, title[:60], (0, 17), 24)
    start = text_width(title[:60], 24) + 18
    if start + text_width(subtitle, 14) <= width:
        put_text(bar, subtitle, (start, 19), 14, FAINT_TEXT)
    return bar


def _legend(width: int) -> Image:
    return draw_legend(width, 26, 14, (FINGER_COLOURS["middle"], UNLABELLED_COLOUR), FAINT_TEXT)
