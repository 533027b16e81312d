"""Picture of an experiment: the plot of its module, and the figures of both below."""

from collections.abc import Sequence
from io import BytesIO
from typing import Any

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from depthtrack.benchmarks.papers.experiment import Experiment, PaperComparison
from depthtrack.evaluation.sweep.rows import Row

_STYLE: dict[Any, Any] = {
    "font.size": 9,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "0.9",
    "legend.frameon": False,
    "lines.linewidth": 1.6,
    "lines.markersize": 4.5,
    # Distinct with colour blindness (Okabe and Ito 2008), in an order that is distinct in grey.
    "axes.prop_cycle": "cycler('color', ['#0072B2', '#E69F00', '#009E73', '#D55E00', '#CC79A7', '#56B4E9'])",
}
_INCHES = (7.2, 4.2)
"""Width and height of the plot."""
_LONGEST = 48
"""Characters of a description beyond which its text is smaller, so that it ends before the next column."""
_LINE = 0.2
"""Height of a line of text below the axes, inches."""


def draw_png(experiment: Experiment, rows: Sequence[Row], comparisons: Sequence[PaperComparison], note: str) -> bytes:
    """Return the picture as the content of a PNG file.

    note: last line of the picture, which describes the measurements.
    """
    below = [("", experiment.reference, "ours"), *map(_line, comparisons), ("", "", ""), (note, "", "")]
    height = _INCHES[1] + _LINE * (len(below) + 1)
    with rc_context(_STYLE):
        figure = Figure((_INCHES[0], height), dpi=150)
        axes = figure.add_axes((0.09, 1 - (_INCHES[1] - 0.55) / height, 0.88, (_INCHES[1] - 1.0) / height))
        experiment.draw(axes, rows)
        axes.set_title(f"{experiment.title}\n", loc="left", fontweight="bold")
        axes.text(0, 1.02, experiment.source, transform=axes.transAxes, color="0.4")
        for number, cells in enumerate(below, start=1):
            y = (_LINE * (len(below) - number) + 0.12) / height
            for x, text in zip((0.09, 0.56, 0.86), cells, strict=True):
                size = _STYLE["font.size"] * min(1.0, _LONGEST / max(len(text), 1)) if number < len(below) else None
                figure.text(x, y, text, color="0.4" if number in (1, len(below)) else "0.1", fontsize=size)
        picture = BytesIO()
        figure.savefig(picture, format="png")
    return picture.getvalue()


def plain_log_scale(axes: Axes) -> None:
    """Draw y logarithmically, with numbers at powers of ten.

    Below three decades, 2 and 5 times them have numbers too.
    """
    axes.set_yscale("log")
    low, high = axes.get_ylim()
    axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5) if high < 1000 * low else (1,)))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_locator(NullLocator())


def mark(axes: Axes, x: float, text: str) -> None:
    """Draw a vertical line at `x` with a text beside it."""
    axes.axvline(x, color="0.5", linestyle=":")
    axes.text(x, 0.98, f" {text}".replace("\n", "\n "), va="top", color="0.35", transform=axes.get_xaxis_transform())


def _line(comparison: PaperComparison) -> tuple[str, str, str]:
    return comparison.what, comparison.paper, comparison.ours_text


def error_and_time(
    axes: Axes, x: Sequence[float], rows: Sequence[Row], at: float, paper_deg: float, paper_ms: float
) -> None:
    """Draw the mean joint angle error (left axis) and the time of the median frame (right axis).

    x: values on the horizontal axis, one per row.
    at: value at which the paper gives its figures.
    paper_deg: upper bound of the error in the paper, degrees.
    paper_ms: time in the paper, ms.
    """
    box = axes.get_position()
    axes.set_position((box.x0, box.y0, 0.945 * box.width, box.height))
    clock = axes.twinx()
    axes.plot(x, [row["error_deg"] for row in rows], marker="o", label="ours: error, left")
    clock.plot(x, [row["ms_per_frame"] for row in rows], marker="s", color="C1", label="ours: time on one core, right")
    axes.plot(
        [at - 0.4, at + 0.4], [paper_deg] * 2, color="C0", linestyle="--", label="paper: upper bound of the error"
    )
    clock.plot(at, paper_ms, "D", color="C1", mec="black", ms=6, label="paper: time on eight threads")
    axes.set(ylabel="joint angle error (deg)", ylim=(0, 1.4 * axes.get_ylim()[1]))
    clock.set(ylabel="time of a frame (ms)", ylim=(0, 1.2 * clock.get_ylim()[1]))
    clock.grid(visible=False)
    clock.spines["right"].set_visible(True)
    handles = [handle for each in (axes, clock) for handle in each.get_legend_handles_labels()[0]]
    clock.legend(handles=handles, loc="upper right")
