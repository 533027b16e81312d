"""Conversion of a recording into the folder that all tools read, or into an MCAP file."""

from collections.abc import Callable, Iterable
from pathlib import Path

from depthtrack.errors import InputError
from depthtrack.recording.bags.writer import McapWriter
from depthtrack.recording.keypoints import KEYPOINTS_FILE, read_keypoints
from depthtrack.recording.sequence import Frame, Sequence
from depthtrack.recording.sequences.base import BaseSequence
from depthtrack.recording.writer import ColourFormat, SequenceWriter

MCAP = ".mcap"


def convert(
    sequence: Sequence,
    out: Path,
    frames: int | None = None,
    colour_format: ColourFormat = "png",
    overwrite: bool = False,
    progress: Callable[[Iterable[Frame]], Iterable[Frame]] = iter,
) -> int:
    """Write a recording to `out`, complete or absent, and return the number of frames.

    out: a name that ends in .mcap for that format, else the name of a sequence folder. Only the folder holds ground
        truth, masks and keypoints.
    frames: number of first frames to write; all if None.
    progress: wraps the iteration of frames to show progress.

    Raises:
        InputError: if the recording has no depth, or `out` cannot be written or exists.
        DamagedFrameError: if a frame cannot be read and the recording was not opened to skip such frames.
    """
    if not sequence.has_depth:
        raise InputError(f"{sequence.name} has no depth images, so it cannot be converted")
    indices = range(len(sequence) if frames is None else min(frames, len(sequence)))
    read = progress(sequence.frames(indices))
    if out.suffix.lower() == MCAP:
        return _write_mcap(sequence, read, out, overwrite)
    return _write_folder(sequence, read, out, colour_format, overwrite)


def _write_mcap(sequence: Sequence, frames: Iterable[Frame], out: Path, overwrite: bool) -> int:
    count = 0
    with McapWriter(out, sequence.camera, overwrite) as writer:
        for frame in frames:
            writer.append(frame.timestamp, frame.depth, frame.colour)
            count += 1
    return count


def _write_folder(
    sequence: Sequence, frames: Iterable[Frame], out: Path, colour_format: ColourFormat, overwrite: bool
) -> int:
    count = 0
    description = {**sequence.description, "converted_from": sequence.name}
    with SequenceWriter(
        out,
        sequence.camera,
        hand=sequence.hand,
        description=description,
        colour_format=colour_format,
        overwrite=overwrite,
    ) as writer:
        for frame in _with_keypoints(sequence, frames):
            truth = sequence.ground_truth
            row = None if truth is None else truth.at(frame.timestamp)
            writer.append(
                frame.timestamp,
                frame.depth,
                colour=frame.colour,
                mask=sequence.hand_mask(frame.index),
                exact_depth=sequence.exact_depth(frame.index),
                pose=None if row is None or truth is None or truth.poses is None else truth.poses[row],
                joints=None if row is None or truth is None or truth.joints is None else truth.joints[row],
                keypoints=frame.keypoints,
            )
            count += 1
    return count


def _with_keypoints(sequence: Sequence, frames: Iterable[Frame]) -> Iterable[Frame]:
    """Return the frames with the keypoints of the folder, unless images are mirrored."""
    if not isinstance(sequence, BaseSequence) or sequence.reading.mirror:
        return frames
    path = sequence.path / KEYPOINTS_FILE
    return read_keypoints(path).attach(frames, sequence.timestamps) if path.is_file() else frames
