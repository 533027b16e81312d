"""`depthtrack view` on a run: show the tracked hand over its recording."""

from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING

from depthtrack.cli.progress import bar
from depthtrack.cli.reading_arguments import ReadingArguments
from depthtrack.cli.view_options import ViewOptions
from depthtrack.cli.window import why_no_window
from depthtrack.errors import InputError

if TYPE_CHECKING:
    from depthtrack.evaluation.replay import Replay

_NOT_FOR_RUNS = ("strip", "depth_range")
_CAMERA = ("camera", "camera_preset", "fx", "fy", "cx", "cy")
_READING = tuple(field.name for field in fields(ReadingArguments))
"""Options of the camera and of reading, which a run stores."""


def view_run(options: ViewOptions) -> None:
    """Show the run that the options name.

    Raises:
        InputError: if an option is not for runs, or the run or its recording is unusable.
        MissingExtraError: if the viewer is not installed.
    """
    from depthtrack.evaluation.replay import Replay
    from depthtrack.recording.run_folder import Run

    recording = options.recording
    for owner, names in ((options, _NOT_FOR_RUNS), (recording, _CAMERA), (recording.reading, _READING)):
        for name in names:
            if getattr(owner, name) not in (None, False, (), "auto"):
                raise InputError(f"--{name.replace('_', '-')} applies to recordings: leave it out for a run")
    replay = Replay.open(Run.load(options.recording.path), options.sequence)
    if options.sheet is not None:
        _write_sheet(replay, options, options.sheet)
    if options.video is not None:
        _write_video(replay, options, options.video)
    if options.rrd is not None:
        from depthtrack.viewing.rerun_run_viewer import RerunRunViewer

        count = RerunRunViewer(replay).save(options.rrd, bar(replay))
        print(f"wrote {options.rrd}: {count} frames; open it with  rerun {options.rrd}")
    if options.web:
        _serve(replay)
    if not (options.sheet or options.video or options.rrd or options.web):
        _show(replay, options)


def _show(replay: "Replay", options: ViewOptions) -> None:
    """Open the interactive viewer, or write a contact sheet if that is impossible."""
    reason = why_no_window()
    if reason is not None:
        _write_sheet(replay, options, Path(f"{replay.run.folder.resolve().name}-contact-sheet.png"))
        print(reason)
        return
    from depthtrack.viewing.rerun_run_viewer import RerunRunViewer

    viewer = RerunRunViewer(replay)
    viewer.open_window()
    for replayed in bar(replay):
        viewer.log(replayed)
    viewer.close()


def _serve(replay: "Replay") -> None:
    from time import sleep

    from depthtrack.viewing.rerun_run_viewer import RerunRunViewer

    viewer = RerunRunViewer(replay)
    print(f"the viewer is at {viewer.serve()}  (Ctrl-C ends it)", flush=True)
    try:
        for replayed in bar(replay):
            viewer.log(replayed)
        while True:
            sleep(3600)
    except KeyboardInterrupt:
        print()


def _write_sheet(replay: "Replay", options: ViewOptions, path: Path) -> None:
    from depthtrack.viewing.annotated_frame import evenly_spaced
    from depthtrack.viewing.contact_sheet import save_picture
    from depthtrack.viewing.run_sheet import run_sheet

    row_of = {int(index): row for row, index in enumerate(replay.run.index)}
    outside = [index for index in options.frames if index not in row_of]
    if outside:
        raise InputError(
            f"--frames must be frames of the run {replay.run.folder}, found {outside[0]}: choose among its frames"
        )
    rows = [row_of[index] for index in options.frames] or evenly_spaced(len(replay), options.count or 12)
    save_picture(run_sheet(replay, rows), path)
    print(f"wrote the contact sheet {path}")


def _write_video(replay: "Replay", options: ViewOptions, path: Path) -> None:
    from depthtrack.viewing.run_video import write_run_video
    from depthtrack.viewing.video import WEB_CODECS

    codecs = WEB_CODECS if options.codec == "web" else None
    count = write_run_video(replay, path, codecs, progress=bar)
    print(f"wrote the video {path}: {count} frames")
