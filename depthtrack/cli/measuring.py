"""Calibrate hands on recordings, with a progress bar."""

from typing import TYPE_CHECKING

from depthtrack.cli.progress import percent_bar

if TYPE_CHECKING:
    from depthtrack.calibration.calibrate import Calibration
    from depthtrack.calibration.options import CalibrationOptions
    from depthtrack.calibration.rig_calibration import RigCalibration
    from depthtrack.hand.shape import HandShape, Side
    from depthtrack.recording import Sequence
    from depthtrack.segmentation.options import SegmentationOptions


def calibrate_sequence(
    sequence: "Sequence",
    segmentation: "SegmentationOptions",
    side: "Side | None" = None,
    seed: int = 0,
    threads: int | None = None,
    frames: int | None = None,
    options: "CalibrationOptions | None" = None,
) -> "Calibration":
    """Return the calibration of a recording's hand; both sides are tried if `side` is None.

    Raises:
        InputError: the recording does not show the hand well enough.
    """
    from depthtrack.api.measuring import calibrate

    with percent_bar() as show:
        return calibrate(
            sequence,
            side,
            segmentation=segmentation,
            seed=seed,
            threads=threads,
            frames=frames,
            progress=show,
            options=options,
        )


def calibrate_rig_on_sequence(
    sequence: "Sequence",
    segmentation: "SegmentationOptions",
    rig: "HandShape",
    seed: int = 0,
    threads: int | None = None,
) -> "RigCalibration":
    """Return a rigged hand at the scale of the recording's hand.

    Raises:
        InputError: the recording does not show such a hand.
    """
    from depthtrack.api.measuring import calibrate_rig

    with percent_bar() as show:
        return calibrate_rig(sequence, rig, segmentation=segmentation, seed=seed, threads=threads, progress=show)
