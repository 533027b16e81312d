"""`depthtrack live`: track a hand from a camera, or from a recording played like one."""

from collections.abc import Iterator
from contextlib import ExitStack, closing
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from depthtrack.cli.argument_checks import Output
from depthtrack.cli.ending import Terminated
from depthtrack.cli.reading_arguments import ReadingArguments
from depthtrack.cli.recording_options import PresetName, RecordingOptions
from depthtrack.cli.stated_default import number, stated_default
from depthtrack.errors import InputError
from depthtrack.tracking.configuration import TrackerName

if TYPE_CHECKING:
    from depthtrack.api.live import HandTracker
    from depthtrack.live.frames import LiveFrame, LiveSource
    from depthtrack.live.tracking import LiveEstimate, LiveReport
    from depthtrack.viewing.rerun_live_viewer import LiveMoment, RerunLiveViewer

_REALSENSE = "realsense"
_WARM_UP_FRAMES = 3
"""Frames that are tracked once before the start, because the first call of a kernel compiles it."""


@dataclass(frozen=True)
class Command:
    """Track a hand live, and report latency and dropped frames.

    The source is a RealSense camera, or a recording of any format. A recording is tracked frame by frame, or with
    --realtime as a camera would deliver it: frames that come while the tracker is busy are dropped, with small gaps as
    long as it is less than a second late. Ctrl-C ends it.
    """

    source: Annotated[str, tyro.conf.arg(metavar="FILE|realsense")]
    """A recording, or a RealSense camera by pyrealsense2 (extra `realsense`)."""
    realtime: bool = False
    """Play a recording at its own rate, and drop frames when late."""
    tracker: TrackerName = "hybrid"
    """Tracker: ik is the fastest."""
    hand: Annotated[str | None, stated_default(metavar="HAND.json|RIG.glb|average")] = None
    """A hand file, a rigged mesh or the average adult's (default: the hand is measured while it is tracked)."""
    smooth: bool = False
    """Filter the poses over time (one-euro filter), which delays motion."""
    frames: Annotated[int | None, number(1, 10**7, metavar="N")] = None
    """End after N tracked frames."""
    view: bool = False
    """Show frames, hand and latency in the rerun viewer (extra `view`)."""
    rrd: Annotated[Path | None, Output("file", (".rrd",)), stated_default(metavar="FILE.rrd")] = None
    """File of the viewer to write."""
    json: bool = False
    """Print the figures as JSON."""
    serial: Annotated[str | None, stated_default(metavar="NUMBER")] = None
    """Serial number of the camera (default: the first one)."""
    camera: Annotated[Path | None, stated_default(metavar="FILE.json")] = None
    """Camera of a recording in place of its own."""
    camera_preset: Annotated[PresetName | None, stated_default(metavar="kinect1|kinect2|realsense|tum")] = None
    """Nominal camera of a sensor, in place of the recording's own."""
    reading: tyro.conf.OmitArgPrefixes[ReadingArguments] = field(default_factory=ReadingArguments)
    threads: Annotated[int | None, number(1, 1024, metavar="N")] = None
    """Threads of renderer and fits (default: one per core)."""

    def run(self) -> None:
        from depthtrack.live.tracking import LiveReport
        from depthtrack.strict_data import json_text

        self._check()
        report = LiveReport()
        with ExitStack() as stack:
            source = stack.enter_context(closing(self._source()))
            frames = self._warmed_up(source)
            tracker = stack.enter_context(self._tracker(source))
            self._show(source, self._tracked(frames, tracker, report), tracker)
        print(json_text(report.to_fields(), indent=2) if self.json else report.text())

    def _check(self) -> None:
        """Raise InputError if an option is out of range, or options exclude each other."""
        if self.tracker == "lift":
            raise InputError("--tracker lift needs 2D keypoints, which a live source does not have: choose another one")
        if self.view and self.rrd is not None:
            raise InputError("--view and --rrd exclude each other: give one of them")
        if self.reading != ReadingArguments() and self.source == _REALSENSE:
            raise InputError(
                "options about reading, such as --depth-only, are of recordings: leave them out for a camera"
            )
        if self.serial is not None and self.source != _REALSENSE:
            raise InputError("--serial is of a camera: use --source realsense")

    def _source(self) -> "LiveSource":
        from depthtrack.live.played_recording import PlayedRecording
        from depthtrack.live.realsense import RealSenseSource

        if self.source == _REALSENSE:
            return RealSenseSource(self.serial)
        options = RecordingOptions(
            Path(self.source), self.camera, self.camera_preset, on_damage="skip", reading=self.reading
        )
        return PlayedRecording(options.open(tracked=True), self.realtime)

    def _warmed_up(self, source: "LiveSource") -> "Iterator[LiveFrame]":
        """Return the frames of a source, after a tracker of its own has tracked some.

        They are the first frames of a camera, whose later ones are returned, and are played again in a recording.
        """
        from depthtrack.live.frame_queue import queue_frames
        from depthtrack.live.tracking import track_live

        frames = queue_frames(source) if self.source == _REALSENSE else iter(source)
        if self.source != _REALSENSE and not self.realtime:
            return frames
        with self._tracker(source) as tracker:
            for _ in islice(track_live(frames, tracker), _WARM_UP_FRAMES):
                pass
        return frames if self.source == _REALSENSE else iter(source)

    def _tracker(self, source: "LiveSource") -> "HandTracker":
        from depthtrack.api.live import HandTracker

        return HandTracker(source.camera, self.hand, self.tracker, threads=self.threads)

    def _tracked(
        self, frames: "Iterator[LiveFrame]", tracker: "HandTracker", report: "LiveReport"
    ) -> "Iterator[LiveEstimate]":
        """Yield tracked frames until the source ends or the user interrupts."""
        from depthtrack.cli.progress import counter
        from depthtrack.hand.one_euro import OneEuroFilter
        from depthtrack.live.tracking import track_live

        smooth = OneEuroFilter() if self.smooth else None
        with counter(self.frames) as shown:
            try:
                for each in islice(track_live(frames, tracker, smooth=smooth), self.frames):
                    report.add(each)
                    shown.update()
                    shown.set_postfix_str(f"{each.estimate.status}, {1000 * each.latency:.0f} ms")
                    yield each
            except Terminated:
                raise
            except KeyboardInterrupt:
                return

    def _show(self, source: "LiveSource", tracked: "Iterator[LiveEstimate]", tracker: "HandTracker") -> None:
        """Consume tracked frames: show them, write them, or neither."""
        first = next(tracked, None)
        if first is None:
            return
        moments = _moments(first, tracked, tracker)
        if self.rrd is not None:
            _viewer(source, first).save(self.rrd, moments)
        elif self.view:
            viewer = _viewer(source, first)
            viewer.open_window()
            for moment in moments:
                viewer.log(moment)
            viewer.close()
        else:
            for _ in tracked:
                pass


def _viewer(source: "LiveSource", first: "LiveEstimate") -> "RerunLiveViewer":
    from depthtrack.viewing.depth_colours import depth_range
    from depthtrack.viewing.rerun_live_viewer import RerunLiveViewer

    depth = first.frame.depth
    metres = source.camera.metres(depth) if depth.dtype.kind == "u" else depth
    return RerunLiveViewer(source.name, source.camera, *depth_range(metres))


def _moments(first: "LiveEstimate", others: "Iterator[LiveEstimate]", tracker: "HandTracker") -> "Iterator[LiveMoment]":
    from itertools import chain

    from depthtrack.viewing.annotated_frame import AnnotatedFrame
    from depthtrack.viewing.rerun_live_viewer import LiveMoment

    for each in chain([first], others):
        last = tracker.last
        assert last is not None
        seen = last.observation
        mask = None if seen is None else seen.whole_mask(last.frame.depth.shape)
        keypoints = None if each.pose is None else tracker.keypoints(replace(each.estimate, pose=each.pose))
        annotated = AnnotatedFrame(last.frame, mask, keypoints=keypoints)
        yield LiveMoment(annotated, each.estimate.status, each.latency, each.dropped)
