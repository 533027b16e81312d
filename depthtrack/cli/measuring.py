"""The calibration that `calibrate` and `demo` share, with its progress shown."""

from typing import TYPE_CHECKING

from depthtrack.cli.progress import percent_bar

if TYPE_CHECKING:
    from depthtrack.calibration.calibrate import Calibration
    from depthtrack.hand.shape import Side
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
