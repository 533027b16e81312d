"""Acceptance of what a calibration was given: a hand, or another object."""

from collections.abc import Sequence

import numpy as np

from depthtrack.errors import InputError


def check_resembles_hand(agreements: Sequence[float], least: float) -> None:
    """Check that the median agreement of the silhouettes is at least `least`.

    Raises:
        InputError: if it is lower.
    """
    if np.median(agreements) < least:
        raise InputError(
            f"the object found in {len(agreements)} frames does not resemble a hand (silhouettes agree to "
            f"{np.median(agreements):.0%}): calibrate on a recording of one bare hand, best with open fingers"
        )
