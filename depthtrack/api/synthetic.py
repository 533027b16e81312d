"""Make synthetic recordings and marker captures with exact ground truth."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from depthtrack.recording.registry import open_sequence
from depthtrack.recording.sequence import Sequence
from depthtrack.synthesis import marker_capture
from depthtrack.synthesis.generate import Synthesis, Synthesiser, write_recording
from depthtrack.synthesis.marker_capture import MarkerSynthesis, SyntheticMarkers
from depthtrack.synthesis.marker_folder import write_synthetic_markers


def synthesise(
    motion: str | Synthesis, out: Path | str, *, overwrite: bool = False, threads: int = 2, **options: Any
) -> Sequence:
    """Write a recording of a moving hand with exact ground truth, and open it.

    Ground truth is the pose, the keypoints, the hand mask and the exact depth of each frame.

    motion: name of a motion (everyday, grasp, signs, fast, random, ...), path of a motion file, or all options.
    overwrite: replace the recording that `out` holds.
    threads: workers; the recording does not depend on it.
    options: fields of `Synthesis`: sensor, background, model, hand, distance (m), frames, rate (Hz), seed, ...

    Raises:
        InputError: an option is out of range, the motion does not exist, or `out` exists.

    Example:
        recording = depthtrack.synthesise("grasp", "my-grasp", model="skin", sensor="kinect1", frames=90)
    """
    settings = Synthesis(motion, **options) if isinstance(motion, str) else replace(motion, **options)
    write_recording(Synthesiser(settings), Path(out), overwrite, threads)
    return open_sequence(Path(out))


def synthesise_markers(
    motion: str | MarkerSynthesis, out: Path | str | None = None, *, overwrite: bool = False, **options: Any
) -> SyntheticMarkers:
    """Make an optical marker capture of moving hands with exact truth.

    Its points have no labels, and another order in each frame. Equal options give equal bytes.

    motion: name of a motion, path of a motion file, or all options.
    out: folder to write: the capture (capture.csv), its truth, and the models that a user has.
    overwrite: replace the synthetic capture that `out` holds.
    options: fields of `MarkerSynthesis`: layout, hand, two_hands, touching, rigid_bodies, frames, rate (Hz), errors,
        seed, ... `errors` is a `MeasurementErrors`: noise (m), dropouts, bursts (s), ghosts.

    Returns:
        The capture, its true labels and poses, positions (T, M, 3) of all markers in metres, and the user's models.

    Raises:
        InputError: an option is out of range, the motion or the layout does not exist, or `out` is in use.

    Example:
        made = depthtrack.synthesise_markers("grasp", "my-capture", layout="26", frames=1000, seed=1000)
        solution = depthtrack.solve_markers("my-capture/capture.csv", ["26"], out="solved")
        print(depthtrack.evaluate_markers("solved").labels.f1)
    """
    settings = MarkerSynthesis(motion, **options) if isinstance(motion, str) else replace(motion, **options)
    made = marker_capture.synthesise_markers(settings)
    if out is not None:
        write_synthetic_markers(made, Path(out), ".csv", overwrite)
    return made
