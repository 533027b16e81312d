"""Make synthetic recordings with exact ground truth."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from depthtrack.recording.registry import open_sequence
from depthtrack.recording.sequence import Sequence
from depthtrack.synthesis.generate import Synthesis, Synthesiser, write_recording


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
