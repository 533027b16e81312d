"""Calibrate hands on recordings, with a progress bar."""

from typing import TYPE_CHECKING

from depthtrack.cli.progress import percent_bar

if TYPE_CHECKING:
    from depthtrack.calibration.calibrate import Calibration
    from depthtrack.calibration.pose_search import ScorerFactory
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
    from depthtrack.calibration.calibrate import calibrate
    from depthtrack.calibration.views import choose_views

    with percent_bar() as show:
        show("choosing frames", 0.0)
        views = choose_views(sequence, segmenter)
        return calibrate(views, _scorers(threads), side, seed, source, show)


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
    from depthtrack.calibration.rig_calibration import calibrate_rig
    from depthtrack.calibration.views import choose_views

    with percent_bar() as show:
        show("choosing frames", 0.0)
        views = choose_views(sequence, segmenter)
        return calibrate_rig(views, rig, _scorers(threads), seed, f"scaled on {sequence.name}", show)


def _scorers(threads: int | None) -> "ScorerFactory":
    """Return the factory of raster scorers, which use all cores by default."""
    from functools import partial

    from depthtrack.machine import usable_cores
    from depthtrack.rendering.raster import RasterScorer

    return partial(RasterScorer, threads=threads or usable_cores())
