"""The video of a labelled capture: hands, bodies and markers of every frame."""

from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from depthtrack.types import Image
from depthtrack.viewing.marker_pictures import whole_view
from depthtrack.viewing.marker_scene import MarkerScene, View
from depthtrack.viewing.panels import captioned
from depthtrack.viewing.video import VideoWriter

Progress = Callable[[Iterable[int]], Iterable[int]]
"""Wraps the indices of the frames, for a progress bar."""
_FASTEST = 30.0
"""Pictures a second at most: the frames between are left out."""


def write_marker_video(
    scene: MarkerScene,
    path: Path,
    codecs: tuple[str, ...] | None = None,
    height: int = 720,
    progress: Progress = iter,
    speed: float = 1.0,
) -> int:
    """Write a labelled capture as a video, atomically, and return the number of pictures.

    The file is mp4 or webm. The camera stays where it shows the whole path.

    height: of a picture, pixels.
    speed: playback speed relative to the capture.

    Raises:
        InputError: if the video cannot be written.
    """
    capture, view = scene.labelled.capture, whole_view(scene)
    view = view.resized(height / view.camera.height)
    step = max(1, round(speed * capture.rate / _FASTEST))
    with VideoWriter(path, speed * capture.rate / step, codecs) as writer:
        for frame in progress(range(0, len(capture), step)):
            writer.write(_picture(scene, frame, view))
    return writer.frame_count


def _picture(scene: MarkerScene, frame: int, view: View) -> Image:
    labelled = scene.labelled
    measured = sum(int((columns[frame] >= 0).sum()) for columns in labelled.columns)
    markers = sum(len(model.labels) for model in labelled.models)
    lost = sum(not np.isfinite(poses[frame]).all() for poses in labelled.poses)
    remark = f"{measured} of {markers} markers" + (f"  ·  {lost} lost" if lost else "")
    left = f"frame {labelled.capture.first_frame + frame}  ·  {labelled.capture.times[frame]:.2f} s"
    return captioned(scene.draw(frame, view), left, remark)
