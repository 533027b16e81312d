"""Association of colour images with depth images by time."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.types import Array

MAX_COLOUR_DELAY = 0.02
"""Largest difference of timestamps, seconds, between associated depth and colour images."""
_LONGEST_DELAY = 0.05
"""The same for depth at less than 25 Hz."""
_REPORTED_SHIFT = 0.01
"""Median difference of timestamps that is reported, seconds."""


@dataclass(frozen=True)
class ColourAssociation:
    """The colour image of each depth image that has one.

    partner: index of the colour image by index of the depth image.
    offset: median time of the colour after the depth, seconds; None without any pair.
    by_order: whether images are paired by their order, because their clocks differ.
    note: sentence for the user; None if every depth image has colour of its time.
    """

    partner: dict[int, int] = field(default_factory=dict)
    offset: float | None = None
    by_order: bool = False
    note: str | None = None


def associate_colour(depth: Array, colour: Array) -> ColourAssociation:
    """Return the association of depth (D,) and colour (C,) by their times, seconds, increasing.

    The largest difference is 20 ms, or half the period of slower depth up to 50 ms. Two clocks without a common time
    are paired by order if both counts agree.
    """
    if not len(colour):
        return ColourAssociation()
    period = float(np.median(np.diff(depth))) if len(depth) > 1 else 0.0
    partner = associate(depth, colour, min(max(MAX_COLOUR_DELAY, period / 2), _LONGEST_DELAY))
    if not partner:
        return _apart(depth, colour)
    offset = float(np.median([colour[j] - depth[i] for i, j in partner.items()]))
    parts = []
    if len(partner) < len(depth):
        parts.append(f"colour in {len(partner)} of {len(depth)} frames, depth alone in the others")
    if abs(offset) >= _REPORTED_SHIFT:
        when = "after" if offset > 0 else "before"
        parts.append(f"colour is {1000 * abs(offset):.0f} ms {when} the depth in the median")
    return ColourAssociation(partner, offset, note="; ".join(parts) or None)


def _apart(depth: Array, colour: Array) -> ColourAssociation:
    """Return the association of images without any pair of near times."""
    shift = float(colour[0] - depth[0])
    common = colour[0] <= depth[-1] and depth[0] <= colour[-1]
    if common or len(depth) != len(colour):
        note = f"no colour is near a depth image in time, the first one is {shift:+.3f} s from it: depth alone"
        return ColourAssociation(note=note)
    note = f"colour has another clock, {shift:+.3f} s from that of the depth: images are paired by their order"
    return ColourAssociation({i: i for i in range(len(depth))}, shift, by_order=True, note=note)


def associate(depth: ArrayLike, colour: ArrayLike, max_difference: float = MAX_COLOUR_DELAY) -> dict[int, int]:
    """Return the nearest colour image of each depth image that has one within `max_difference`.

    `depth` (D,) and `colour` (C,) are strictly increasing timestamps in seconds. Of two equally near colour images the
    earlier one is taken. Unlike in TUM's associate.py, a colour image may serve two depth images: with cameras half a
    period apart, a one-to-one association leaves up to a third of the depth images without colour.
    """
    times, candidates = np.asarray(depth, dtype=np.float64), np.asarray(colour, dtype=np.float64)
    if not len(candidates):
        return {}
    after = np.searchsorted(candidates, times).clip(0, len(candidates) - 1)
    before = np.maximum(after - 1, 0)
    nearest = np.where(times - candidates[before] <= candidates[after] - times, before, after)
    rows = np.flatnonzero(np.abs(candidates[nearest] - times) < max_difference)
    return dict(zip(rows.tolist(), nearest[rows].tolist(), strict=True))
