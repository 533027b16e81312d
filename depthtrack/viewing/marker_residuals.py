"""Plot of the residual of each marker of a labelled capture over time."""

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.types import Array
from depthtrack.viewing.plots import PLOT_STYLE, PLOT_WIDTH, png

_COLOURS = "viridis"
_COLUMNS = 1400
"""Most columns of a residual map; each then has the worst of its frames."""
_ROW, _LINE = 0.17, 0.9
"""Height of a marker's row and of the line above the rows, inches."""
_LEAST_SCALE = 2.0
"""Smallest upper end of the residual scale, mm."""
_HEAD = 1.05
"""Height of the heading and of the scale below it, inches."""


def residual_png(labelled: LabelledCapture, title: str) -> bytes:
    """Return a PNG file of the residuals over time.

    A model has a line, the root mean square of its markers, and a row for each marker. All rows have one colour scale,
    and all lines one axis. A frame without the marker is grey.
    """
    models = labelled.models
    heights = [_LINE + 0.25 + _ROW * len(model.labels) + 0.35 for model in models]
    total = sum(heights) + _HEAD + 0.3
    residuals = [1000 * labelled.residuals(k) for k in range(len(models))]
    limit = max(
        _LEAST_SCALE, *(float(np.nanpercentile(each, 99.5)) for each in residuals if np.isfinite(each).any()), 0
    )
    with rc_context(PLOT_STYLE):
        figure = Figure((PLOT_WIDTH, total), dpi=130)
        figure.text(0.01, 1 - 0.22 / total, title, va="center", fontsize=12)
        _draw_scale(figure, total, limit)
        highest = max((float(np.nanmax(rms)) for rms in map(_rms, residuals) if np.isfinite(rms).any()), default=1.0)
        top = total - _HEAD
        for k, height in enumerate(heights):
            rows = _ROW * len(models[k].labels)
            line = figure.add_axes((0.13, (top - _LINE) / total, 0.78, (_LINE - 0.2) / total))
            _draw_line(line, labelled, residuals[k], models[k].name, 1.05 * highest)
            bottom = top - _LINE - rows - 0.05
            _draw_rows(figure, (0.13, bottom / total, 0.78, rows / total), labelled, k, residuals[k], limit)
            top -= height
        return png(figure)


def _draw_scale(figure: Figure, total: float, limit: float) -> None:
    """Draw the colour scale that all rows share, below the heading."""
    axes = figure.add_axes((0.13, 1 - 0.62 / total, 0.3, 0.12 / total))
    shades = ScalarMappable(Normalize(0, limit), _COLOURS)
    bar = figure.colorbar(shades, cax=axes, orientation="horizontal", extend="max")
    bar.ax.tick_params(labelsize=7)
    words = "mm, of all rows; grey: not measured; numbers on the right: root mean square of a row"
    figure.text(0.45, 1 - 0.56 / total, words, va="center", fontsize=8, color="0.3")


def _rms(residuals: Array) -> Array:
    return np.sqrt(_nan_mean(residuals**2))


def _draw_line(axes: Axes, labelled: LabelledCapture, residuals: Array, name: str, highest: float) -> None:
    rms = _rms(residuals)
    edges, line = _blocks(rms[:, None], labelled.capture.times)
    axes.plot(edges[:-1], line[:, 0], color="0.2", lw=0.8)
    axes.set(xlim=(edges[0], edges[-1]), ylim=(0, highest), ylabel="rms, mm")
    axes.tick_params(labelbottom=False)
    known = rms[np.isfinite(rms)]
    mean = f"mean {float(known.mean()):.2f} mm" if len(known) else "no residual"
    axes.set_title(f"{name}: {mean}", loc="left", fontsize=9)


def _draw_rows(
    figure: Figure,
    place: tuple[float, float, float, float],
    labelled: LabelledCapture,
    k: int,
    residuals: Array,
    limit: float,
) -> None:
    labels, axes = labelled.models[k].labels, figure.add_axes(place)
    edges, worst = _blocks(residuals, labelled.capture.times)
    axes.set_facecolor("0.85")
    axes.pcolormesh(edges, np.arange(len(labels) + 1), worst.T, vmin=0, vmax=limit, cmap=_COLOURS)
    axes.invert_yaxis()
    axes.set_yticks(np.arange(len(labels)) + 0.5, labels, fontsize=7)
    axes.tick_params(axis="y", length=0)
    axes.set(xlim=(edges[0], edges[-1]), xlabel="seconds" if k == len(labelled.models) - 1 else "")
    means = _rms(residuals.T)
    for row, mean in enumerate(means):
        text = f"{mean:.2f}" if np.isfinite(mean) else "none"
        axes.text(1.005, row + 0.5, text, va="center", fontsize=7, transform=axes.get_yaxis_transform())


def _blocks(values: Array, times: Array) -> tuple[Array, Array]:
    """Return the edges (N + 1,) of blocks of frames, seconds, and their largest values (N, M).

    A block without a value has NaN.
    """
    count = len(values)
    frames = -(-count // _COLUMNS)
    padded = np.full((-(-count // frames) * frames, values.shape[1]), -np.inf)
    padded[:count] = np.where(np.isfinite(values), values, -np.inf)
    largest = padded.reshape(-1, frames, values.shape[1]).max(axis=1)
    step = float(times[1] - times[0]) if count > 1 else 1.0
    edges = np.append(np.arange(0, count, frames), count) * step
    return edges, np.where(np.isfinite(largest), largest, np.nan)


def _nan_mean(values: Array) -> Array:
    """Return the mean over the last axis of the finite values; NaN without any."""
    known = np.isfinite(values)
    count = known.sum(axis=-1)
    total = np.where(known, values, 0.0).sum(axis=-1)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)
