"""The plots of the page, as SVG that inherits colours and fonts from the page."""

import re
from collections.abc import Sequence
from io import StringIO
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from depthtrack.evaluation.metrics.success import LIMIT_MM
from depthtrack.hand.pose import FINGERS
from depthtrack.report.colours import FAINT, GRID, INK, PAPER, placeholder, with_variables
from depthtrack.report.series import (
    TrackerSeries,
    axis_limit,
    finger_errors,
    metric_curve,
    stage_medians,
    success_curve,
)

_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    # Makes the SVG reproducible.
    "svg.hashsalt": "depthtrack",
    "text.parse_math": False,
    "font.size": 8.5,
    "text.color": INK,
    "axes.labelcolor": FAINT,
    "axes.edgecolor": GRID,
    "axes.linewidth": 1.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.spines.left": False,
    "axes.grid": True,
    "axes.grid.axis": "y",
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.8,
    "xtick.color": GRID,
    "ytick.color": GRID,
    "xtick.labelcolor": FAINT,
    "ytick.labelcolor": FAINT,
    "ytick.major.size": 0,
    "lines.linewidth": 1.5,
    "lines.solid_capstyle": "round",
}
_WIDE, _THIRD = (10.6, 2.5), (3.4, 2.45)
_DASHES = ("-", (0, (4, 1.6)), (0, (1.2, 1.4)), (0, (6, 1.5, 1.2, 1.5)))
"""Trackers also differ in line style, for grey print and colour vision deficiency."""

TIMELINE_FROM, TIMELINE_TO = 0.052, 0.992
"""Positions of the first and the last second in a time plot, relative to its width."""


def timeline(series: Sequence[TrackerSeries], metric: str, unit: str, small: bool = False) -> tuple[str, str]:
    """Return the SVG of a metric of each tracker over time, and a remark on how it is drawn."""
    with rc_context(_STYLE):
        figure, axes = _figure(_THIRD, left=0.13) if small else _figure(_WIDE, TIMELINE_FROM, TIMELINE_TO, 0.19)
        curves = [metric_curve(each.result, metric) for each in series]
        for each, curve in zip(series, curves, strict=True):
            colour, style = _line_style(each.number)
            if len(each.result.evaluations) > 1:
                axes.fill_between(curve.seconds, curve.low, curve.high, color=colour, alpha=0.18, lw=0)
            axes.plot(curve.seconds, curve.median, color=colour, linestyle=style, lw=1.3)
            _mark_losses(axes, each)
        end = max((curve.seconds[-1] for curve in curves if len(curve.seconds)), default=1.0)
        axes.set(xlim=(0, max(float(end), 1e-3)), xlabel="seconds", ylabel=unit)
        remarks = []
        if metric == "silhouette_iou":
            axes.set_ylim(min(0.5, min(float(np.nanmin([*c.low, 1.0])) for c in curves)), 1)
        else:
            top, largest = axis_limit(curves)
            axes.set_ylim(0, top)
            if largest > top:
                remarks.append(f"peaks up to {largest:.0f} {unit} are clipped")
        if (frames := max(curve.frames_per_point for curve in curves)) > 1:
            remarks.append(f"each point is the worst of {frames} frames")
        if any(len(each.result.evaluations) > 1 for each in series):
            remarks.append("line: median of the runs; band: their range")
        if any(each.result.lost for each in series):
            remarks.append("ticks below: frames that the tracker lost")
        return _svg(figure, f"{metric} over time"), "; ".join(remarks)


def share_curves(series: Sequence[TrackerSeries]) -> str | None:
    """Return the SVG of the share of frames under each threshold; None without errors and E3D."""
    curves = [(each, curve) for each in series if (curve := success_curve(each.result)) is not None]
    if not curves:
        return None
    with rc_context(_STYLE):
        figure, axes = _figure(_THIRD, left=0.13)
        for each, (thresholds, share) in curves:
            colour, style = _line_style(each.number)
            axes.plot(thresholds, 100 * share, color=colour, linestyle=style)
        limit = float(curves[0][1][0][-1])
        axes.set(xlim=(0, limit), ylim=(0, 101), xlabel="threshold, mm", ylabel="frames, %")
        axes.set_xticks(np.arange(0, limit + 1, 10 if limit == LIMIT_MM else 5))
        return _svg(figure, "share of frames under a threshold")


def finger_bars(series: Sequence[TrackerSeries]) -> str | None:
    """Return the SVG of each finger's mean error and 95th percentile; None without ground truth."""
    errors = [(each, found) for each in series if (found := finger_errors(each.result))]
    if not errors:
        return None
    with rc_context(_STYLE):
        figure, axes = _figure(_THIRD, left=0.1)
        width = 0.8 / len(errors)
        for k, (each, found) in enumerate(errors):
            x = np.arange(len(FINGERS)) + (k - (len(errors) - 1) / 2) * width
            means, tails = (np.array([found.get(finger, (np.nan, np.nan))[j] for finger in FINGERS]) for j in (0, 1))
            axes.bar(x, means, width=0.86 * width, color=placeholder(each.number))
            axes.vlines(x, means, tails, color=placeholder(each.number), lw=1)
            axes.plot(x, tails, "_", color=placeholder(each.number), ms=5)
        axes.set(ylabel="mm", ylim=(0, None))
        axes.set_xticks(range(len(FINGERS)), FINGERS)
        axes.tick_params(axis="x", length=0)
        return _svg(figure, "error of each finger")


def stage_bars(series: Sequence[TrackerSeries]) -> str | None:
    """Return the SVG of the time per stage as stacked bars; None without stored times."""
    stages = [(each, found) for each in series if (found := stage_medians(each.result))]
    if not stages:
        return None
    with rc_context(_STYLE | {"axes.grid.axis": "x"}):
        figure, axes = _figure((_THIRD[0], max(_THIRD[1], 0.75 + 0.42 * len(stages))), left=0.03, right=0.97)
        longest = max(sum(found.values()) for _, found in stages)
        for row, (each, found) in enumerate(stages):
            left = 0.0
            for k, (stage, ms) in enumerate(found.items()):
                alpha = 1 - 0.55 * k / max(1, len(found) - 1)
                axes.barh(
                    row, ms, left=left, height=0.34, color=placeholder(each.number), alpha=alpha, ec=PAPER, lw=0.8
                )
                if ms > 0.11 * longest:
                    axes.text(left + ms / 2, row + 0.3, stage, ha="center", va="center", fontsize=7.5, color=FAINT)
                left += ms
            axes.text(0, row - 0.31, f"{each.label}: {left:.1f} ms", ha="left", va="center", fontsize=8.5)
        axes.set(xlim=(0, 1.02 * longest), ylim=(len(stages) - 0.45, -0.55), xlabel="ms a frame, median of each stage")
        axes.set_yticks([])
        return _svg(figure, "time per stage")


def _mark_losses(axes: Axes, each: TrackerSeries) -> None:
    """Draw a tick at the bottom for every lost frame of any run."""
    for evaluation in each.result.evaluations:
        lost = np.nonzero(evaluation.losses.lost)[0]
        if len(lost):
            times = evaluation.run.timestamps
            at = np.unique(np.round(times[lost] - times[0], 1))
            height = 0.02 + 0.03 * each.number
            axes.plot(
                at,
                np.full(len(at), height),
                "|",
                color=placeholder(each.number),
                ms=5,
                transform=axes.get_xaxis_transform(),
            )


def _figure(inches: tuple[float, float], left: float, right: float = 0.98, bottom: float = 0.2) -> tuple[Figure, Axes]:
    figure = Figure(inches)
    return figure, figure.add_axes((left, bottom, right - left, 0.95 - bottom))


def _line_style(number: int) -> tuple[str, Any]:
    return placeholder(number), _DASHES[number % len(_DASHES)]


def _svg(figure: Figure, about: str) -> str:
    """Return a figure as an inline SVG element that fills the available width."""
    text = StringIO()
    figure.savefig(text, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    svg = text.getvalue()
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>\s*", "", svg, flags=re.DOTALL)
    # Identifiers of groups would not be unique in a page with several plots.
    svg = re.sub(r'<g id="[^"]*">', "<g>", svg)
    svg = re.sub(r"<svg [^>]*?viewBox=\"([^\"]*)\"[^>]*>", rf'<svg viewBox="\1" role="img" aria-label="{about}">', svg)
    svg = svg.replace("xlink:href", "href")
    return with_variables(re.sub(r"\n\s*", "\n", svg))
