"""Accept a path, a name or the object itself for a recording, a hand or a tracker."""

from pathlib import Path

from depthtrack.calibration.sides import calibrate_either_side
from depthtrack.errors import InputError
from depthtrack.geometry.camera import PRESETS, Camera
from depthtrack.geometry.camera_files import read_camera
from depthtrack.hand.hand_file import load_hand
from depthtrack.hand.shape import HandShape
from depthtrack.recording.depth_checks import check_depth
from depthtrack.recording.hand_choice import AVERAGE, chosen_hand
from depthtrack.recording.reading import ReadingOptions, TimeUnit
from depthtrack.recording.registry import open_sequence
from depthtrack.recording.sequence import OnDamage, Sequence
from depthtrack.recording.sequences.base import BaseSequence
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.tracking.configuration import TrackerConfig
from depthtrack.tracking.registry import tracker_config

Recording = Sequence | Path | str
"""A recording, or its path."""
Hand = HandShape | Path | str | None
"""A hand, the path of a hand file or rigged mesh, or "average" for the average adult's right hand.

None measures the hand where one is tracked, else it is the average one.
"""


def open_recording(
    path: Path | str,
    camera: Camera | Path | str | None = None,
    on_damage: OnDamage = "refuse",
    *,
    depth_topic: str | None = None,
    colour_topic: str | None = None,
    time_unit: TimeUnit = "auto",
    depth_scale: float | None = None,
    invalid: tuple[int, ...] = (),
    mirror: bool = False,
    depth_only: bool = False,
    distortion: tuple[float, ...] = (),
) -> Sequence:
    """Open a recording; frames are read one at a time.

    camera: camera to use instead of the recording's own: a `Camera`, a preset such as "tum", or a `camera.json`.
    on_damage: "refuse" raises an error at a frame that cannot be read, "skip" leaves it out.
    depth_topic, colour_topic: topics of the images in a bag; those found by their type if absent.
    time_unit: unit of the times in lists: "s", "ms", "us", "ns", "frames" at 30 Hz, or "index" to ignore the times.
    depth_scale: length of one unit of the stored depth, metres; that of the camera if absent.
    invalid: stored depth values that mean no reading, beside 0.
    mirror: mirror the images left to right; the camera is that of the mirrored images.
    depth_only: ignore colour.
    distortion: lens distortion of the given camera, k1 k2 p1 p2 k3 k4 k5 k6, which is removed.

    Raises:
        InputError: `path` holds no recording, or its camera is unknown.

    Example:
        recording = depthtrack.open_recording("my-hand")
        print(len(recording), recording.camera, recording[0].depth.max())
    """
    if isinstance(camera, str) and camera in PRESETS:
        camera = PRESETS[camera]
    elif isinstance(camera, str | Path):
        file = read_camera(Path(camera))
        camera, distortion = file.camera, file.distortion or distortion
    reading = ReadingOptions(depth_topic, colour_topic, time_unit, depth_scale, invalid, mirror, depth_only, distortion)
    return open_sequence(path, camera, on_damage, reading)


def as_recording(recording: Recording) -> Sequence:
    """Return the recording itself, opened if it is a path. Raises InputError."""
    return open_sequence(recording) if isinstance(recording, str | Path) else recording


def to_track(recording: Recording) -> Sequence:
    """Return the recording, in which a hand is to be tracked.

    One that is open already is not checked.

    Raises:
        InputError: if it cannot be read, or its depth cannot be right.
    """
    sequence = as_recording(recording)
    if sequence is not recording:
        check_depth(sequence)
    return sequence


def path_of(recording: Sequence) -> Path:
    """Return the path of an opened recording.

    Raises:
        InputError: the recording was not read from a path.
    """
    if not isinstance(recording, BaseSequence):
        raise InputError(
            f"expected a recording that was opened from a path, found {type(recording).__name__}: "
            "push its frames to a HandTracker"
        )
    return recording.path


def on_damage_of(recording: Sequence) -> OnDamage:
    """Return what an opened recording does at a frame that cannot be read."""
    return recording.on_damage if isinstance(recording, BaseSequence) else "refuse"


def open_hand(hand: Hand = None, recording: Recording | None = None) -> HandShape:
    """Return the hand that a path or name stands for.

    hand: path of a hand file (hand.json) or rigged mesh (.glb, .gltf), "truth" for the recording's own sizes, or
        "average". The average adult's right hand is also returned if it is absent. A hand is returned as it is.

    Raises:
        InputError: the file holds no hand, or the recording has no sizes.

    Example:
        hand = depthtrack.open_hand("hand.json")
        tips = depthtrack.HandModel(hand).keypoints(pose)[4::4]
    """
    if isinstance(hand, HandShape):
        return hand
    if recording is not None:
        return chosen_hand(as_recording(recording), None if hand is None else str(hand))
    return HandShape() if hand in (None, AVERAGE) else load_hand(Path(str(hand)))


def measured_hand(
    recording: Sequence,
    segmentation: SegmentationOptions | None = None,
    threads: int = 1,
    frames: int | None = None,
) -> HandShape:
    """Return the hand of a recording, measured while it is tracked.

    The average adult's right hand takes its place where the recording does not show a hand well enough.

    frames: number of first frames that the hand is measured on; all if absent.
    """
    try:
        return calibrate_either_side(recording, segmentation, threads=threads, frames=frames).hand
    except InputError:
        return HandShape()


def as_config(tracker: str | TrackerConfig) -> TrackerConfig:
    """Return the configuration itself, or the default one of a name. Raises InputError."""
    return tracker_config(tracker) if isinstance(tracker, str) else tracker
