"""`depthtrack view`: show a recording, or a run over its recording."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from depthtrack.cli.progress import bar
from depthtrack.cli.view_options import MOST_FRAMES, ViewOptions
from depthtrack.cli.window import why_no_window
from depthtrack.errors import InputError

if TYPE_CHECKING:
    from depthtrack.recording import Sequence
    from depthtrack.viewing.annotated_frame import AnnotatedFrame, MaskEstimator
    from depthtrack.viewing.rerun_viewer import RerunViewer


@dataclass(frozen=True)
class Command(ViewOptions):
    """Show a recording, a run from `depthtrack track`, or a folder from `depthtrack markers`.

    A recording is shown with depth, colour, hand mask and true skeleton. A run is shown as the tracked hand over its
    recording, with the residual, skeletons, and energies over time. Labelled markers are shown with names and hands.

    Opens the interactive viewer if it is installed and a screen is available; otherwise writes a contact sheet. The
    options below write files instead and can be combined.
    """

    def run(self) -> None:
        from depthtrack.markers.folder.contents import is_marker_folder
        from depthtrack.viewing.annotated_frame import sequence_depth_range

        self._check_options()
        if (self.recording.path / "run.json").exists():
            from depthtrack.cli.view_run import view_run

            view_run(self)
            return
        if is_marker_folder(self.recording.path):
            from depthtrack.cli.view_markers import view_markers

            view_markers(self)
            return
        sequence = self.recording.open()
        near, far = self.depth_range or sequence_depth_range(sequence)
        if self.sheet is not None:
            self._write_sheet(sequence, self.sheet, near, far)
        if self.strip is not None:
            self._write_strip(sequence, self.strip)
        if self.video is not None:
            self._write_video(sequence, self.video, near, far)
        if self.rrd is not None:
            _write_rrd(_viewer(sequence, near, far), self.rrd, self._all_frames(sequence))
        if self.web:
            self._serve(sequence, near, far)
        if not (self.sheet or self.strip or self.video or self.rrd or self.web):
            self._show(sequence, near, far)
        for frame in sequence.damaged:
            print(f"skipped frame {frame.index} at {frame.timestamp:.3f} s: {frame.reason}")

    def _check_options(self) -> None:
        if len(self.frames) > MOST_FRAMES:
            raise InputError(f"--frames must name at most {MOST_FRAMES} frames, found {len(self.frames)}")
        if self.depth_range is not None and not 0 < self.depth_range[0] < self.depth_range[1] < float("inf"):
            raise InputError(f"--depth-range must be two increasing numbers of metres, found {self.depth_range}")

    def _show(self, sequence: "Sequence", near: float, far: float) -> None:
        """Open the interactive viewer, or write a contact sheet if that is impossible."""
        reason = why_no_window()
        if reason is None:
            viewer = _viewer(sequence, near, far)
            viewer.open_window()
            for annotated in self._all_frames(sequence):
                viewer.log(annotated)
            viewer.close()
        else:
            self._write_sheet(sequence, Path(f"{sequence.name}-contact-sheet.png"), near, far)
            print(reason)

    def _serve(self, sequence: "Sequence", near: float, far: float) -> None:
        from time import sleep

        viewer = _viewer(sequence, near, far)
        print(f"the viewer is at {viewer.serve()}  (Ctrl-C ends it)", flush=True)
        try:
            for annotated in self._all_frames(sequence):
                viewer.log(annotated)
            while True:
                sleep(3600)
        except KeyboardInterrupt:
            print()

    def _write_sheet(self, sequence: "Sequence", path: Path, near: float, far: float) -> None:
        from depthtrack.viewing.contact_sheet import contact_sheet, describe, save_picture

        frames = self._chosen_frames(sequence, self.count or 12)
        save_picture(contact_sheet(frames, sequence.name, describe(sequence), near, far), path)
        print(f"wrote the contact sheet {path}")

    def _write_strip(self, sequence: "Sequence", path: Path) -> None:
        from depthtrack.viewing.contact_sheet import save_picture
        from depthtrack.viewing.strip import strip

        save_picture(strip(self._chosen_frames(sequence, self.count or 7)), path)
        print(f"wrote the strip {path}")

    def _write_video(self, sequence: "Sequence", path: Path, near: float, far: float) -> None:
        from depthtrack.viewing.contact_sheet import frame_rate
        from depthtrack.viewing.panels import panel, useful_layers
        from depthtrack.viewing.video import QUICK_CODECS, WEB_CODECS, VideoWriter

        layers = useful_layers(sequence, self._estimator())
        codecs = WEB_CODECS if self.codec == "web" else QUICK_CODECS
        with VideoWriter(path, frame_rate(sequence) or 30.0, codecs) as writer:
            for annotated in self._all_frames(sequence):
                writer.write(panel(annotated, layers, 360, near, far))
        print(f"wrote the video {path}: {writer.frame_count} frames")

    def _all_frames(self, sequence: "Sequence") -> "Iterator[AnnotatedFrame]":
        """Yield every frame, with a progress bar on a terminal."""
        from depthtrack.viewing.annotated_frame import annotated_frames

        yield from bar(annotated_frames(sequence, None, self._estimator()), total=len(sequence))

    def _chosen_frames(self, sequence: "Sequence", count: int) -> "Iterator[AnnotatedFrame]":
        from depthtrack.viewing.annotated_frame import annotated_frames, evenly_spaced

        outside = [index for index in self.frames if not 0 <= index < len(sequence)]
        if outside:
            raise InputError(f"--frames must be from 0 to {len(sequence) - 1} in {sequence.name}, found {outside[0]}")
        return annotated_frames(sequence, self.frames or evenly_spaced(len(sequence), count), self._estimator())

    def _estimator(self) -> "MaskEstimator | None":
        """Return a new mask estimator for one pass over the recording; None if not wanted."""
        if not self.estimate:
            return None
        from depthtrack.viewing.estimated_masks import mask_estimator

        return mask_estimator()


def _viewer(sequence: "Sequence", near: float, far: float) -> "RerunViewer":
    from depthtrack.viewing.rerun_viewer import RerunViewer

    return RerunViewer(sequence.name, sequence.camera, near, far)


def _write_rrd(viewer: "RerunViewer", path: Path, moments: "Iterable[AnnotatedFrame]") -> None:
    count = viewer.save(path, moments)
    print(f"wrote {path}: {count} frames; open it with  rerun {path}")
