"""How well a baseline fills stretches of the capture itself that are held out.

The error of a baseline depends on the motion of the capture. Stretches as long as its gaps are cut where their markers
are visible, and filled. The ratio of their errors to those that the time to a measured frame predicts scales the
expected errors of the real gaps. The prediction itself counts as one stretch.
"""

from collections.abc import Callable, Sequence

import numpy as np

from depthtrack.markers.filled_capture import Gap, measured_samples
from depthtrack.markers.filling.expected_error import error_after
from depthtrack.markers.filling.options import FillMethod
from depthtrack.markers.filling.prediction import time_to_measured
from depthtrack.types import Array, Mask

Fill = Callable[[list[Array], list[list[Gap]]], list[Array]]
"""Returns the positions (T, M, 3) of each model in its gaps, from the measured ones."""
_MOST = 40
"""Most stretches that are held out."""
_LARGEST_RATIO = 3.0
"""Multiple of the median ratio that a single stretch counts as, at most."""
_MARGIN = 5
"""Visible frames on both sides of a stretch."""


def error_scale(
    fill: Fill, method: FillMethod, measured: list[Array], gaps: Sequence[Sequence[Gap]], rate: float
) -> float:
    """Return the factor of expected errors; 1 if nothing can be held out.

    measured: (T, M, 3) of each model, metres, NaN if not measured.
    gaps: those to fill, of each model.
    """
    trials = _trials([measured_samples(positions) for positions in measured], [gap for some in gaps for gap in some])
    cut = [np.array(positions) for positions in measured]
    for gap in trials:
        cut[gap.model][gap.start : gap.stop, gap.marker] = np.nan
    filled = fill(cut, [[gap for gap in trials if gap.model == k] for k in range(len(measured))])
    times = [time_to_measured(measured_samples(positions), rate) for positions in cut]
    ratios = [1.0]
    for k, m, start, stop in trials:
        errors = np.sum((filled[k] - measured[k])[start:stop, m] ** 2, axis=-1)
        if np.isfinite(errors).all():
            expected = error_after(method, times[k][start:stop, m]) ** 2
            ratios.append(float(np.sqrt(np.mean(errors) / np.mean(expected))))
    return float(np.sqrt(np.mean(np.square(np.minimum(ratios, _LARGEST_RATIO * np.median(ratios))))))


def _trials(visible: list[Mask], gaps: Sequence[Gap]) -> list[Gap]:
    """Return stretches as long as some gaps, of the same markers where they are visible."""
    generator, trials = np.random.default_rng(0), []
    free = [seen.copy() for seen in visible]
    for n in np.unique(np.linspace(0, len(gaps) - 1, min(len(gaps), _MOST)).astype(int)) if gaps else ():
        k, m, start, stop = gaps[n]
        around = stop - start + 2 * _MARGIN
        runs = np.convolve(free[k][:, m], np.ones(around), "valid") if around <= len(free[k]) else np.empty(0)
        places = np.flatnonzero(runs > around - 0.5)
        if len(places):
            first = int(places[generator.integers(len(places))]) + _MARGIN
            trials.append(Gap(k, m, first, first + stop - start))
            free[k][first - _MARGIN : first + stop - start + _MARGIN, m] = False
    return trials
