"""Lift 2D keypoints and depth images to metric poses."""

from pathlib import Path

from depthtrack.api.choices import Hand, Recording, open_hand, to_track
from depthtrack.api.runs import track
from depthtrack.calibration.lifted_hand import measure_lifted_hand
from depthtrack.hand.shape import Side
from depthtrack.recording.keypoints import read_keypoints
from depthtrack.recording.run_folder import Run
from depthtrack.tracking.configuration import LiftConfig


def lift(
    recording: Recording,
    keypoints: Path | str,
    hand: Hand = None,
    *,
    out: Path | str,
    side: Side | None = None,
    refine: bool = True,
    resume: bool = False,
    frames: int | None = None,
    threads: int | None = None,
) -> Run:
    """Turn 2D keypoints of a detector into poses of a hand; they are those of `depthtrack lift`.

    keypoints: path of a file of keypoints (docs/keypoints.md).
    hand: see `track`; if absent, the average adult's hand in the size of the keypoints over the recording.
    out: run folder to write.
    side: of the hand that is measured; the one that fits better if absent.
    refine: fit the lifted poses to the surface, and keep those with a lower energy.
    resume: continue the run that `out` holds.
    frames: number of frames to lift; all if absent.
    threads: threads of the renderer, one per core if absent; poses do not depend on it.

    Raises:
        InputError: the recording, the keypoints, the hand or the run folder cannot be used.

    Example:
        run = depthtrack.lift("my-hand", "keypoints.csv", out="my-run")
        print(depthtrack.joint_track(run).keypoints[:, 8])
    """
    sequence = to_track(recording)
    if hand is None:
        chosen = measure_lifted_hand(sequence, read_keypoints(Path(keypoints)), side).hand
    else:
        chosen = open_hand(hand, sequence)
    config = LiftConfig(refine=refine)
    return track(sequence, chosen, config, out=out, resume=resume, frames=frames, threads=threads, keypoints=keypoints)
