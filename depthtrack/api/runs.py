"""Track recordings into run folders, and read, evaluate and export runs."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import overload

from depthtrack.api.choices import (
    Hand,
    Recording,
    as_config,
    measured_hand,
    on_damage_of,
    open_hand,
    path_of,
    to_track,
)
from depthtrack.evaluation.evaluate import Evaluation
from depthtrack.evaluation.evaluate import evaluate as evaluate_replay
from depthtrack.evaluation.replay import Replay, run_hand
from depthtrack.export.joint_track import JointTrack
from depthtrack.export.registry import export_joints
from depthtrack.hand.one_euro import OneEuroOptions
from depthtrack.machine import usable_cores
from depthtrack.recording.run_folder import Run
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.tracking.backward_options import BackwardOptions, chosen_backward
from depthtrack.tracking.configuration import DEFAULT_TRACKER, TrackerConfig
from depthtrack.tracking.pipeline import TrackedFrame
from depthtrack.tracking.run import TrackingRun, check_run, configure
from depthtrack.tracking.run_configuration import Start


@overload
def track(
    recording: Recording,
    hand: Hand = None,
    tracker: str | TrackerConfig = DEFAULT_TRACKER,
    *,
    out: None = None,
    resume: bool = False,
    start: Start = "auto",
    frames: int | None = None,
    segmentation: SegmentationOptions | None = None,
    threads: int | None = None,
    keypoints: Path | str | None = None,
    backward: bool | BackwardOptions | None = None,
) -> Iterator[TrackedFrame]: ...


@overload
def track(
    recording: Recording,
    hand: Hand = None,
    tracker: str | TrackerConfig = DEFAULT_TRACKER,
    *,
    out: Path | str,
    resume: bool = False,
    start: Start = "auto",
    frames: int | None = None,
    segmentation: SegmentationOptions | None = None,
    threads: int | None = None,
    keypoints: Path | str | None = None,
    backward: bool | BackwardOptions | None = None,
) -> Run: ...


def track(
    recording: Recording,
    hand: Hand = None,
    tracker: str | TrackerConfig = DEFAULT_TRACKER,
    *,
    out: Path | str | None = None,
    resume: bool = False,
    start: Start = "auto",
    frames: int | None = None,
    segmentation: SegmentationOptions | None = None,
    threads: int | None = None,
    keypoints: Path | str | None = None,
    backward: bool | BackwardOptions | None = None,
) -> Iterator[TrackedFrame] | Run:
    """Track the hand of a recording; the poses of a written run are those of `depthtrack track`.

    hand: a hand, the path of a hand file or rigged mesh, "truth", or "average" for the average adult's right hand. If
        absent, it is measured first, while it is tracked in up to 160 frames.
    tracker: name or configuration of a tracker: see `tracker_config`.
    out: run folder to write; without it, frames are yielded as they are tracked.
    resume: continue the run that `out` holds.
    start: "auto" searches the hand, "truth" starts from the recording's true pose of its first frame.
    frames: number of frames to track; all if absent.
    segmentation: how the hand is found in a frame.
    threads: threads of renderer and fits, one per core if absent; poses do not depend on it.
    keypoints: path of a file of 2D keypoints from another detector (docs/keypoints.md).
    backward: track doubtful stretches of the written run backwards as well, from the confident pose after them, or
        the options of that. The default is yes, but not with a deadline or a tracker of the papers. Yielded frames are
        tracked forward alone.

    Returns:
        The run if `out` is given, else an iterator over tracked frames. Poses (27,) are metres, quaternion and radians
        in the camera frame.

    Raises:
        InputError: the recording, the hand, an option or the run folder cannot be used.

    Example:
        for each in depthtrack.track("my-hand", tracker="ik"):
            print(each.frame.timestamp, each.estimate.status, each.estimate.pose)
        run = depthtrack.track("my-hand", "hand.json", out="my-run")
    """
    sequence, threads, config = to_track(recording), threads or usable_cores(), as_config(tracker)
    configuration = configure(
        path_of(sequence),
        sequence,
        config,
        open_hand(hand, sequence),
        segmentation,
        start=start,
        frames=frames,
        on_damage=on_damage_of(sequence),
        keypoints=None if keypoints is None else str(Path(keypoints).resolve()),
        backward=chosen_backward(backward, config),
    )
    if hand is None:
        check_run(configuration, sequence, None if out is None else Path(out), resume)
        measured = measured_hand(sequence, segmentation, threads, frames)
        configuration = replace(configuration, hand=measured.to_fields())
    run = TrackingRun(configuration, sequence, threads)
    if out is None:
        return _tracked(run)
    with run:
        for _ in run.write(Path(out), resume):
            pass
    return Run.load(Path(out))


def _tracked(run: TrackingRun) -> Iterator[TrackedFrame]:
    with run:
        yield from run.track()


def read_run(folder: Path | str) -> Run:
    """Read a run folder, whole or cut short.

    Raises:
        InputError: the folder holds no run, or a damaged one.

    Example:
        run = depthtrack.read_run("my-run")
        print(run.timestamps.shape, run.poses.shape, run.status.count("lost"))
    """
    return Run.load(Path(folder))


def evaluate(run: Run | Path | str, recording: Path | str | None = None, *, residuals: bool = True) -> Evaluation:
    """Compare a run with its recording.

    The figures are errors against ground truth, residuals, losses, jitter and time.

    recording: where the recording is, if it was moved since.
    residuals: segment each frame again, for the metrics that need no ground truth.

    Raises:
        InputError: the run or its recording cannot be read, or they do not belong together.

    Example:
        evaluation = depthtrack.evaluate("my-run")
        for metric in evaluation.metrics:
            print(metric.name, metric.statistics())
    """
    run = run if isinstance(run, Run) else read_run(run)
    return evaluate_replay(Replay.open(run, None if recording is None else Path(recording)), residuals)


def joint_track(run: Run | Path | str) -> JointTrack:
    """Return the poses (T, 27) and keypoints (T, 21, 3) of a run.

    Both are in metres in the camera frame, and NaN without a pose.

    Raises:
        InputError: the folder holds no run, or its hand is malformed.

    Example:
        index_tip = depthtrack.joint_track("my-run").keypoints[:, 8]
    """
    run = run if isinstance(run, Run) else read_run(run)
    return JointTrack.of(run, run_hand(run))


def export_run(
    run: Run | Path | str, out: Path | str, format: str | None = None, *, smooth: OneEuroOptions | None = None
) -> JointTrack:
    """Write the poses and keypoints of a run to a file, and return them.

    format: one of `EXPORTERS`; by default the one named as the suffix of `out`, or the only one with it.
    smooth: options of a one-euro filter over time, which delays motion; poses are not filtered if absent.

    Raises:
        InputError: the format does not exist or does not fit `out`, or the file cannot be written.

    Example:
        depthtrack.export_run("my-run", "joints.csv")
    """
    track = joint_track(run)
    if smooth is not None:
        track, _ = track.smoothed(smooth)
    export_joints(Path(out), track, format)
    return track
