"""`depthtrack view` on a marker folder: show markers with names, hands and residuals."""

from pathlib import Path
from typing import TYPE_CHECKING

from depthtrack.cli.progress import bar
from depthtrack.cli.view_options import ViewOptions
from depthtrack.cli.window import why_no_window
from depthtrack.errors import InputError

if TYPE_CHECKING:
    from depthtrack.viewing.marker_scene import MarkerScene
    from depthtrack.viewing.rerun_marker_viewer import RerunMarkerViewer

_NOT_FOR_MARKERS = ("strip", "depth_range", "sequence")


def view_markers(options: ViewOptions) -> None:
    """Show the marker folder that the options name.

    Raises:
        InputError: if an option is not for marker folders, or the folder is unusable.
        MissingExtraError: if the viewer is not installed.
    """
    for name in _NOT_FOR_MARKERS:
        if getattr(options, name) is not None:
            raise InputError(f"--{name.replace('_', '-')} does not apply to markers: leave it out")
    folder = options.recording.path
    scene, name = open_scene(folder), folder.resolve().name
    frames = range(len(scene.labelled.capture))
    if options.sheet is not None:
        _write_sheet(scene, options, options.sheet, name)
    if options.video is not None:
        from depthtrack.viewing.video import WEB_CODECS

        write_video(scene, options.video, WEB_CODECS if options.codec == "web" else None)
    if options.rrd is not None:
        count = _viewer(scene, name).save(options.rrd, bar(frames))
        print(f"wrote {options.rrd}: {count} frames; open it with  rerun {options.rrd}")
    if options.web:
        _serve(scene, name)
    if not (options.sheet or options.video or options.rrd or options.web):
        _show(scene, options, name)


def open_scene(folder: Path) -> "MarkerScene":
    """Return the capture of a marker folder to draw, with its filled gaps.

    Raises:
        InputError: if the folder is unusable.
    """
    from depthtrack.markers.folder.reading import MarkerFolder
    from depthtrack.viewing.marker_scene import MarkerScene

    found = MarkerFolder.load(folder)
    return MarkerScene.of(found.labelled) if found.filled is None else MarkerScene.of_filled(found.filled)


def write_video(
    scene: "MarkerScene", path: Path, codecs: tuple[str, ...] | None, height: int = 720, speed: float = 1.0
) -> None:
    """Write a video and print its path. Raises InputError if it cannot be written."""
    from depthtrack.viewing.marker_video import write_marker_video

    count = write_marker_video(scene, path, codecs, height, bar, speed)
    print(f"wrote the video {path}: {count} frames")


def _show(scene: "MarkerScene", options: ViewOptions, name: str) -> None:
    """Open the interactive viewer, or write a sheet if that is impossible."""
    reason = why_no_window()
    if reason is not None:
        _write_sheet(scene, options, Path(f"{name}-markers.png"), name)
        print(reason)
        return
    viewer = _viewer(scene, name)
    viewer.open_window()
    for frame in bar(range(len(scene.labelled.capture))):
        viewer.log(frame)
    viewer.close()


def _serve(scene: "MarkerScene", name: str) -> None:
    from time import sleep

    viewer = _viewer(scene, name)
    print(f"the viewer is at {viewer.serve()}  (Ctrl-C ends it)", flush=True)
    try:
        for frame in bar(range(len(scene.labelled.capture))):
            viewer.log(frame)
        while True:
            sleep(3600)
    except KeyboardInterrupt:
        print()


def _write_sheet(scene: "MarkerScene", options: ViewOptions, path: Path, name: str) -> None:
    from depthtrack.viewing.annotated_frame import evenly_spaced
    from depthtrack.viewing.contact_sheet import save_picture
    from depthtrack.viewing.marker_pictures import marker_sheet

    length = len(scene.labelled.capture)
    outside = [index for index in options.frames if not 0 <= index < length]
    if outside:
        raise InputError(f"--frames must be from 0 to {length - 1} in {name}, found {outside[0]}")
    frames = options.frames or evenly_spaced(length, options.count or 12)
    save_picture(marker_sheet(scene, frames, name), path)
    print(f"wrote the contact sheet {path}")


def _viewer(scene: "MarkerScene", name: str) -> "RerunMarkerViewer":
    from depthtrack.viewing.rerun_marker_viewer import RerunMarkerViewer

    return RerunMarkerViewer(scene, name)
