"""Plots of the filled gaps of a capture."""

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from depthtrack.markers.filled_capture import FilledCapture, Filling, Gap
from depthtrack.types import Index, Mask
from depthtrack.viewing.plots import PLOT_STYLE, PLOT_WIDTH, png

_COLUMNS, _ROWS = 3, 5
GAPS_PER_PAGE = _COLUMNS * _ROWS
_LEAST_CONTEXT = 0.1
"""Least time that is shown before and after a gap, seconds."""
_AXES = ("#0072B2", "#D55E00", "#009E73")
"""Colours of x, y and z: distinct with colour blindness (Okabe and Ito 2008)."""
_BAND = 2.0
"""Half the width of the band of a filled sample, standard deviations."""


def gap_pages(filled: FilledCapture, title: str) -> Iterator[bytes]:
    """Yield PNG files of all filled gaps, `GAPS_PER_PAGE` in each, longest first.

    A panel shows the coordinates, less their values before the gap: dots are measured samples, lines filled ones with
    twice their expected standard deviation.
    """
    gaps = sorted((gap for gap in filled.gaps() if _filled_frames(filled, gap).any()), key=lambda gap: -gap.length)
    pages = -(-len(gaps) // GAPS_PER_PAGE)
    for page in range(pages):
        shown = gaps[page * GAPS_PER_PAGE : (page + 1) * GAPS_PER_PAGE]
        number = f", page {page + 1} of {pages}" if pages > 1 else ""
        yield _gap_page(filled, shown, f"{title}: {len(gaps)} filled gaps{number}")


def _gap_page(filled: FilledCapture, gaps: Sequence[Gap], title: str) -> bytes:
    rows = -(-len(gaps) // _COLUMNS)
    height = 2.3 * rows + 0.75
    with rc_context(PLOT_STYLE):
        figure = Figure((PLOT_WIDTH, height), dpi=130)
        figure.text(0.01, 1 - 0.2 / height, title, va="center", fontsize=12)
        _write_legend(figure, 1 - 0.45 / height)
        for n, gap in enumerate(gaps):
            row, column = divmod(n, _COLUMNS)
            bottom = (2.3 * (rows - 1 - row) + 0.35) / height
            axes = figure.add_axes((0.055 + column * 0.325, bottom, 0.26, 1.6 / height))
            _draw_gap(axes, filled, gap)
        return png(figure)


def _write_legend(figure: Figure, y: float) -> None:
    for n, (axis, colour) in enumerate(zip("xyz", _AXES, strict=True)):
        figure.text(0.055 + 0.02 * n, y, axis, color=colour, va="center", fontweight="bold")
    text = "dots: measured; line: filled, with a band of two expected standard deviations; seconds, mm"
    figure.text(0.055 + 0.07, y, text, color="0.4", va="center")


def _draw_gap(axes: Axes, filled: FilledCapture, gap: Gap) -> None:
    capture, labelled = filled.labelled.capture, filled.labelled
    context = max(gap.length // 2, round(_LEAST_CONTEXT * capture.rate), 3)
    first, last = max(gap.start - context, 0), min(gap.stop + context, len(capture))
    times = capture.times[first:last]
    measured = 1000 * labelled.positions(gap.model)[first:last, gap.marker]
    positions = 1000 * filled.positions[gap.model][first:last, gap.marker]
    band = _BAND * 1000 * filled.expected_error[gap.model][first:last, gap.marker] / np.sqrt(3)
    how = filled.how[gap.model][first:last, gap.marker]
    known = np.flatnonzero(np.isfinite(measured).all(axis=1))
    origin = measured[known[0]] if len(known) else np.zeros(3)
    # The line begins and ends at the measured neighbours.
    line = np.where((how == Filling.MEASURED)[:, None] & ~_beside(how)[:, None], np.nan, positions)
    for axis, colour in enumerate(_AXES):
        axes.plot(times, measured[:, axis] - origin[axis], ".", color=colour, ms=2.5)
        axes.plot(times, line[:, axis] - origin[axis], color=colour)
        low, high = (line[:, axis] - origin[axis] + sign * np.nan_to_num(band) for sign in (-1, 1))
        axes.fill_between(times, low, high, color=colour, alpha=0.22, lw=0)
    axes.axvspan(capture.times[gap.start], capture.times[gap.stop - 1], color="0.94", zorder=0)
    words = dict.fromkeys(Filling(int(h)).word for h in how[gap.start - first : gap.stop - first])
    label = labelled.labels(gap.model)[gap.marker]
    frames = f"frames {capture.first_frame + gap.start} to {capture.first_frame + gap.stop - 1}"
    axes.set_title(f"{label}\n{frames}, {', '.join(words)}", loc="left", fontsize=8)
    axes.set_xlim(times[0], times[-1])


def _beside(how: Index) -> Mask:
    """Return which samples (T,) are next to one that was not measured."""
    missing = how != Filling.MEASURED
    near = np.zeros(len(how), dtype=np.bool_)
    near[1:] |= missing[:-1]
    near[:-1] |= missing[1:]
    return near


def _filled_frames(filled: FilledCapture, gap: Gap) -> Mask:
    how = filled.how[gap.model][gap.start : gap.stop, gap.marker]
    return np.asarray((how != Filling.MEASURED) & (how != Filling.GAP))
