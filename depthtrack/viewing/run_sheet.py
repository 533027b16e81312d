"""Contact sheets of runs: frames with the tracked hand over the recording, and residuals."""

from collections.abc import Collection

import numpy as np

from depthtrack.errors import InputError
from depthtrack.evaluation.replay import Replay
from depthtrack.types import Image
from depthtrack.viewing.contact_sheet import framed
from depthtrack.viewing.panels import beside, blank, captioned, smaller, stacked, tile_grid
from depthtrack.viewing.residual_colours import LARGEST, UNCOVERED, UNREAD, residual_scale
from depthtrack.viewing.run_pictures import LAYERS_WITHOUT_DEPTH, RunLayer, RunPainter
from depthtrack.viewing.text import put_text, text_width
from depthtrack.viewing.theme import FAINT_TEXT, OCCLUDER, STATUS_COLOURS
from depthtrack.viewing.timeline import Timeline


def run_sheet(replay: Replay, rows: Collection[int], height: int = 200, columns: int = 3) -> Image:
    """Return a page of a run's frames.

    rows: rows of the run.
    height: of a view, pixels.
    Result (h, w, 3): RGB.
    Raises: InputError if none of the frames can be read.
    """
    painter, tiles, has_object = RunPainter(replay, 2 * height), [], False
    with_depth, last = replay.sequence.has_depth, max(rows, default=-1)
    layers: tuple[RunLayer, ...] = ("overlay", "residual") if with_depth else LAYERS_WITHOUT_DEPTH
    for replayed in replay:
        if replayed.row in rows:
            views = [painter.view(replayed, layer) for layer in layers]
            small = [smaller(view, view.shape[1] // 2, height) for view in views]
            status, observation = replayed.estimate.status, replayed.observation
            has_object |= observation is not None and observation.occluder is not None
            remark = f"{replayed.frame.timestamp:.2f} s  ·  {status}"
            tiles.append(
                captioned(beside(small, gap=0), f"frame {replayed.frame.index}", remark, STATUS_COLOURS[status])
            )
        if replayed.row >= last:
            break
    if not tiles:
        raise InputError(f"the run {replay.run.folder} has no frame to show: choose another run")
    grid = tile_grid(tiles, min(columns, len(tiles)))
    timeline = Timeline(replay.run.energy, replay.run.status, grid.shape[1])
    legend = [_legend(grid.shape[1], has_object)] if with_depth else []
    return framed(stacked([_title(replay, grid.shape[1]), grid, *legend, timeline.image], gap=12))


def _legend(width: int, has_object: bool) -> Image:
    """Return the legend of the residual's colours and of an object, cut at the page's width."""
    bar, limit, x = blank(width, 22), f"{1000 * LARGEST:.0f} mm", 0
    scale = residual_scale(120, 10)
    for mark, text in (
        (None, f"{limit} nearer"),
        (scale, f"{limit} farther"),
        (np.full((10, 10, 3), UNCOVERED, dtype=np.uint8), "hand not covered"),
        (np.full((10, 10, 3), UNREAD, dtype=np.uint8), "no reading"),
        *([(np.full((10, 10, 3), OCCLUDER, dtype=np.uint8), "object")] if has_object else []),
    ):
        start = x if mark is None else x + mark.shape[1] + 8
        if start + text_width(text, 14) > width:
            break
        if mark is not None:
            bar[6:16, x : x + mark.shape[1]] = mark
        put_text(bar, text, (start, 11), 14, FAINT_TEXT)
        x = start + text_width(text, 14) + (8 if mark is None else 24)
    return bar


def _title(replay: Replay, width: int) -> Image:
    bar, run = blank(width, 34), replay.run
    name = f"{run.folder.resolve().name[:40]}: {str(run.configuration.get('tracker', 'track'))[:20]}"
    put_text(bar, name, (0, 17), 24)
    lost = sum(not status.is_trusted for status in run.status)
    subtitle = f"{len(run.index)} frames of {replay.sequence.name[:40]}  ·  {lost} without a trusted pose"
    start = text_width(name, 24) + 18
    if start + text_width(subtitle, 14) <= width:
        put_text(bar, subtitle, (start, 19), 14, FAINT_TEXT)
    return bar
