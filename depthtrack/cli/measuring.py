"""Calibrate hands on recordings, with a progress bar."""

from typing import TYPE_CHECKING

from depthtrack.cli.progress import percent_bar

if TYPE_CHECKING:
    from depthtrack.calibration.calibrate import Calibration
    from depthtrack.calibration.rig_calibration import RigCalibration
    from depthtrack.hand.shape import HandShape, Side
    from depthtrack.recording import Sequence
    from depthtrack.segmentation.observation import Segmenter


def calibrate_sequence(
    sequence: "Sequence",
    segmenter: "Segmenter",
    side: "Side | None" = None,
    seed: int = 0,
    threads: int | None = None,
    source: str = "",
) -> "Calibration":
    """Return the calibration of a recording's hand; both sides are tried if `side` is None.

    Raises:
        InputError: if the recording does not show the hand well enough.
    """
    from depthtrack.calibration.calibrate import VIEWS, calibrate
    from depthtrack.calibration.views import choose_views
    from depthtrack.machine import usable_cores

    with percent_bar() as show:
        show("choosing frames", 0.0)
        views = choose_views(sequence, segmenter, VIEWS)
        return calibrate(views, side, seed, threads or usable_cores(), source, show)


def calibrate_rig_on_sequence(
    sequence: "Sequence",
    segmenter: "Segmenter",
    rig: "HandShape",
    seed: int = 0,
    threads: int | None = None,
) -> "RigCalibration":
    """Return a rigged hand at the scale of the recording's hand.

    Raises:
        InputError: if the recording does not show such a hand.
    """
    from depthtrack.calibration.calibrate import VIEWS
    from depthtrack.calibration.rig_calibration import calibrate_rig
    from depthtrack.calibration.views import choose_views
    from depthtrack.machine import usable_cores

    with percent_bar() as show:
        show("choosing frames", 0.0)
        views = choose_views(sequence, segmenter, VIEWS)
        return calibrate_rig(views, rig, seed, threads or usable_cores(), f"scaled on {sequence.name}", show)
