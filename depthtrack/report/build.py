"""The report page of evaluated runs: text, table, plots and animations of bounded size."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader
from markupsafe import Markup

from depthtrack import __version__
from depthtrack.errors import InputError
from depthtrack.evaluation.compare.results import TrackerResult, figures_of, tracker_results
from depthtrack.evaluation.evaluate import Evaluation
from depthtrack.files import write_atomic
from depthtrack.recording.sequence import Frame
from depthtrack.report.animation import Animation, make_animation, webp_data_uri
from depthtrack.report.colours import css_variables
from depthtrack.report.narrative import (
    ERRORS,
    Summary,
    error_metric,
    error_name,
    recording_scope,
    summary,
    tracker_summaries,
)
from depthtrack.report.pictures import SideBySide
from depthtrack.report.plots import TIMELINE_FROM, TIMELINE_TO, finger_bars, share_curves, stage_bars, timeline
from depthtrack.report.provenance import Fact, bias_warning, matched_model, recording_facts, tracker_facts
from depthtrack.report.series import TrackerSeries, worst_frames
from depthtrack.report.table import table_head, table_rows

ANIMATION_BYTES, ALL_ANIMATIONS_BYTES = 5_000_000, 30_000_000
"""Approximate largest size of one animation, and of all animations of a page."""
MOST_DETAILED = 12
"""Recordings with plots and images; further ones appear in the table alone."""
WORST = 2
"""Worst frames shown of each tracker."""

Progress = Callable[[Iterable[Frame], str, int], Iterable[Frame]]
"""Wraps an iterator of frames, given a heading and their number, for a progress bar."""


@dataclass(frozen=True)
class Plot:
    """An SVG plot with its title, its quantity, and a remark on how it is drawn."""

    title: str
    about: str
    svg: Markup
    remark: str = ""


@dataclass(frozen=True)
class WorstFrame:
    """One of the frames with a tracker's largest errors, as an image of all trackers.

    seconds: time since the recording's first frame.
    picture: data URI.
    """

    label: str
    number: int
    caption: str
    seconds: float
    picture: str


@dataclass(frozen=True)
class Section:
    """The page's section of one recording; `end` is its duration in seconds."""

    name: str
    series: list[TrackerSeries]
    facts: list[Fact]
    bias_warning: str
    matched_model: tuple[str, ...]
    timeline: Plot
    plots: list[Plot]
    animation: Animation
    end: float
    worst: list[WorstFrame]


def write_report(
    evaluations: Sequence[Evaluation],
    path: Path,
    sequence: Path | None = None,
    progress: Progress = lambda frames, heading, total: frames,
) -> None:
    """Write the report page of evaluated runs, atomically.

    sequence: the recording's present path, if it was moved since the runs.
    Raises: InputError if there is no frame to report, a recording cannot be opened, or the page cannot be written.
    """
    check_reportable(evaluations)
    # Sorted by folder name, so that the page does not depend on the order of the arguments.
    results = tracker_results(sorted(evaluations, key=lambda evaluation: evaluation.run.folder.name))
    numbers = {label: number for number, label in enumerate(dict.fromkeys(result.label for result in results))}
    series = [TrackerSeries(result, numbers[result.label]) for result in results]
    recordings: dict[str, list[TrackerSeries]] = {}
    for each in series:
        recordings.setdefault(each.result.source, []).append(each)
    detailed = list(recordings.values())[:MOST_DETAILED]
    most_bytes = min(ANIMATION_BYTES, ALL_ANIMATIONS_BYTES // len(detailed))
    sections = [_section(each, most_bytes, sequence, progress) for each in detailed]
    page = {
        "version": __version__,
        "summary": _summary(results, sections if len(sections) == len(recordings) else []),
        "tracker_summaries": [(tracker, numbers[tracker.label]) for tracker in tracker_summaries(results)],
        "error_name": error_name(results) + recording_scope(results),
        "head": table_head(results),
        "rows": table_rows(series),
        "sections": sections,
        "left_out": [each[0].result.recording for each in list(recordings.values())[MOST_DETAILED:]],
        "trackers": [(label, number, tracker_facts(label, results)) for label, number in numbers.items()],
        "runs": len(evaluations),
        "from_percent": 100 * TIMELINE_FROM,
        "to_percent": 100 * TIMELINE_TO,
        "light": Markup(css_variables(dark=False)),
        "dark": Markup(css_variables(dark=True)),
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomic(path, _template().render(page))


def check_reportable(evaluations: Sequence[Evaluation]) -> None:
    """Raise InputError if there is no run, or a run without frames."""
    if not evaluations:
        raise InputError("a report needs at least one run, found none")
    for evaluation in evaluations:
        if evaluation.frames == 0:
            raise InputError(f"{evaluation.run.folder} holds no frame yet: track it first, or leave it out")


def _section(series: list[TrackerSeries], most_bytes: int, sequence: Path | None, progress: Progress) -> Section:
    results = [each.result for each in series]
    metric = error_metric(results)
    painter = SideBySide(series, metric, sequence=sequence)
    heading = f"animation of {results[0].recording}"
    animation = make_animation(painter, most_bytes, lambda frames, total: progress(frames, heading, total))
    times = painter.sequence.timestamps[painter.indices]
    return Section(
        results[0].recording,
        series,
        recording_facts(painter.sequence, results[0]),
        bias_warning(painter.sequence.description, results),
        matched_model(painter.sequence.description, results),
        _timeline(series, metric),
        _plots(series, metric),
        animation,
        max(float(times[-1] - times[0]), 1e-3),
        _worst_frames(series, metric, painter),
    )


def _timeline(series: list[TrackerSeries], metric: str) -> Plot:
    svg, remark = timeline(series, metric, "mm")
    title = "Distance of the depth points over time" if metric == "e3d_mm" else "Error over time"
    return Plot(title, ERRORS[metric].replace("median ", "").replace("mean ", ""), Markup(svg), remark)


def _plots(series: list[TrackerSeries], metric: str) -> list[Plot]:
    found = []
    if (svg := share_curves(series)) is not None:
        error = "E3D" if metric == "e3d_mm" else "largest error"
        found.append(Plot("Share of frames under a threshold", f"by a frame's {error}", Markup(svg)))
    if (svg := finger_bars(series)) is not None:
        found.append(Plot("Error of each finger", "mean; whiskers to the 95th percentile", Markup(svg)))
    else:
        svg, _ = timeline(series, "silhouette_iou", "IoU", small=True)
        found.append(Plot("Silhouette IoU", "rendered and observed, over time", Markup(svg)))
    if (svg := stage_bars(series)) is not None:
        clock = series[0].result.evaluations[0].configuration.context.get("clock", "wall")
        about = "CPU time" if clock == "cpu" else "wall-clock time"
        found.append(Plot("Time per stage", about, Markup(svg)))
    return found


def _worst_frames(series: list[TrackerSeries], metric: str, painter: SideBySide) -> list[WorstFrame]:
    found = []
    for each in series:
        evaluation = each.result.evaluations[0]
        figures = figures_of(evaluation).get(metric)
        if figures is None:
            continue
        run = evaluation.run
        for row in worst_frames(figures.values, run.timestamps, WORST):
            caption = f"frame {run.index[row]}, {figures.values[row]:.1f} mm"
            fingers = {finger: errors.values[row] for finger, errors in evaluation.finger_errors.items()}
            known = {finger: error for finger, error in fingers.items() if np.isfinite(error)}
            if known:
                finger = max(known, key=lambda finger: known[finger])
                caption += f"; largest at the {finger}" + (" finger" if finger != "thumb" else "")
            frame = next(iter(painter.sequence.frames([int(run.index[row])])))
            seconds = float(run.timestamps[row] - painter.sequence.timestamps[painter.indices[0]])
            picture = webp_data_uri(painter.picture(frame), quality=70)
            found.append(WorstFrame(each.label, each.number, caption, seconds, picture))
    return found


def _summary(results: Sequence[TrackerResult], sections: Sequence[Section]) -> Summary:
    """Return the page's summary; `sections` of all recordings, or none."""
    contexts = [evaluation.configuration.context for result in results for evaluation in result.evaluations]
    budgets = {(context.get("budget") or {}).get("equal_ms") for context in contexts}
    matched = {section.matched_model for section in sections}
    return summary(
        results,
        next(iter(budgets)) if len(budgets) == 1 else None,
        next(iter(matched)) if len(matched) == 1 else (),
    )


def _template() -> Any:
    pages = Environment(loader=PackageLoader("depthtrack.report", "page"), autoescape=True, trim_blocks=True)
    pages.lstrip_blocks = True
    return pages.get_template("report.html.jinja")
