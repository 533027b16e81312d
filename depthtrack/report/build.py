"""The page from evaluated runs: what it says and shows, recording by recording, within bounded size."""

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
from depthtrack.report.colours import css_variables
from depthtrack.report.film import Film, as_webp, film_of
from depthtrack.report.narrative import ERRORS, Verdict, error_name, judged_by, standings, verdict, where
from depthtrack.report.pictures import SideBySide
from depthtrack.report.plots import TIMELINE_FROM, TIMELINE_TO, finger_bars, share_curves, stage_bars, timeline
from depthtrack.report.provenance import Fact, bias_warning, facts_of_recording, facts_of_tracker, matched_model
from depthtrack.report.series import TrackerSeries, worst_frames
from depthtrack.report.table import table_head, table_rows

FILM_BYTES, ALL_FILMS_BYTES = 5_000_000, 30_000_000
"""A film, and all films of a page, take about so much at most."""
MOST_DETAILED = 12
"""Recordings with plots and pictures; further ones are in the table."""
WORST = 2

Progress = Callable[[Iterable[Frame], str, int], Iterable[Frame]]
"""Watches frames go by, under a heading; told about how many there are."""


@dataclass(frozen=True)
class Plot:
    """A drawing with its title, what it shows, and a remark on how."""

    title: str
    about: str
    svg: Markup
    remark: str = ""


@dataclass(frozen=True)
class Worst:
    """A frame in which a tracker was at its worst: a picture of all trackers there."""

    label: str
    number: int
    told: str
    seconds: float
    picture: str


@dataclass(frozen=True)
class Section:
    """What the page shows of one recording."""

    name: str
    shown: list[TrackerSeries]
    facts: list[Fact]
    bias_warning: str
    matched_model: tuple[str, ...]
    timeline: Plot
    plots: list[Plot]
    film: Film
    end: float
    worst: list[Worst]


def write_report(
    evaluations: Sequence[Evaluation],
    path: Path,
    sequence: Path | None = None,
    progress: Progress = lambda frames, heading, total: frames,
) -> None:
    """Write the page; `sequence` is where the recording lies now, if it was moved. Raises InputError."""
    check_reportable(evaluations)
    # In the order of their folders' names, so that the page is the same whoever asks for it.
    lines = tracker_results(sorted(evaluations, key=lambda evaluation: evaluation.run.folder.name))
    numbers = {label: number for number, label in enumerate(dict.fromkeys(line.label for line in lines))}
    shown = [TrackerSeries(line, numbers[line.label]) for line in lines]
    recordings: dict[str, list[TrackerSeries]] = {}
    for each in shown:
        recordings.setdefault(each.line.source, []).append(each)
    detailed = list(recordings.values())[:MOST_DETAILED]
    most_bytes = min(FILM_BYTES, ALL_FILMS_BYTES // len(detailed))
    sections = [_section(each, most_bytes, sequence, progress) for each in detailed]
    page = {
        "version": __version__,
        "verdict": _verdict(lines, sections if len(sections) == len(recordings) else []),
        "standings": [(standing, numbers[standing.label]) for standing in standings(lines)],
        "judged_by": error_name(lines) + where(lines),
        "head": table_head(lines),
        "rows": table_rows(shown),
        "sections": sections,
        "left_out": [each[0].line.recording for each in list(recordings.values())[MOST_DETAILED:]],
        "trackers": [(label, number, facts_of_tracker(label, lines)) for label, number in numbers.items()],
        "runs": len(evaluations),
        "from_percent": 100 * TIMELINE_FROM,
        "to_percent": 100 * TIMELINE_TO,
        "light": Markup(css_variables(dark=False)),
        "dark": Markup(css_variables(dark=True)),
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomic(path, _template().render(page))


def check_reportable(evaluations: Sequence[Evaluation]) -> None:
    """Raise InputError where there is nothing to tell of."""
    if not evaluations:
        raise InputError("a report needs at least one run")
    for evaluation in evaluations:
        if evaluation.frames == 0:
            raise InputError(f"{evaluation.run.folder} holds no frame yet: track it first, or leave it out")


def _section(shown: list[TrackerSeries], most_bytes: int, sequence: Path | None, progress: Progress) -> Section:
    lines = [each.line for each in shown]
    metric = judged_by(lines)
    painter = SideBySide(shown, metric, sequence=sequence)
    heading = f"film of {lines[0].recording}"
    film = film_of(painter, most_bytes, lambda frames, total: progress(frames, heading, total))
    times = painter.sequence.timestamps[painter.indices]
    return Section(
        lines[0].recording,
        shown,
        facts_of_recording(painter.sequence, lines[0]),
        bias_warning(painter.sequence.description, lines),
        matched_model(painter.sequence.description, lines),
        _timeline(shown, metric),
        _plots(shown, metric),
        film,
        max(float(times[-1] - times[0]), 1e-3),
        _worst(shown, metric, painter),
    )


def _timeline(shown: list[TrackerSeries], metric: str) -> Plot:
    svg, remark = timeline(shown, metric, "mm")
    title = "Distance to the sensor's points over time" if metric == "e3d_mm" else "Error over time"
    return Plot(title, ERRORS[metric].replace("median ", "").replace("mean ", ""), Markup(svg), remark)


def _plots(shown: list[TrackerSeries], metric: str) -> list[Plot]:
    found = []
    if (svg := share_curves(shown)) is not None:
        judged = "E3D" if metric == "e3d_mm" else "largest error"
        found.append(Plot("Share of frames under a threshold", f"by a frame's {judged}", Markup(svg)))
    if (svg := finger_bars(shown)) is not None:
        found.append(Plot("Error of each finger", "mean; whiskers to the 95th percentile", Markup(svg)))
    else:
        svg, _ = timeline(shown, "silhouette_iou", "IoU", small=True)
        found.append(Plot("Agreement of silhouettes", "rendered and seen, over time", Markup(svg)))
    if (svg := stage_bars(shown)) is not None:
        clock = shown[0].line.evaluations[0].configuration.context.get("clock", "wall")
        about = "CPU time" if clock == "cpu" else "by the clock on the wall"
        found.append(Plot("Time per stage", about, Markup(svg)))
    return found


def _worst(shown: list[TrackerSeries], metric: str, painter: SideBySide) -> list[Worst]:
    found = []
    for each in shown:
        evaluation = each.line.evaluations[0]
        figures = figures_of(evaluation).get(metric)
        if figures is None:
            continue
        run = evaluation.run
        for row in worst_frames(figures.values, run.timestamps, WORST):
            told = f"frame {run.index[row]}, {figures.values[row]:.1f} mm"
            fingers = {finger: errors.values[row] for finger, errors in evaluation.finger_errors.items()}
            known = {finger: error for finger, error in fingers.items() if np.isfinite(error)}
            if known:
                finger = max(known, key=lambda finger: known[finger])
                told += f"; most in the {finger} finger" if finger != "thumb" else "; most in the thumb"
            frame = next(iter(painter.sequence.frames([int(run.index[row])])))
            seconds = float(run.timestamps[row] - painter.sequence.timestamps[painter.indices[0]])
            found.append(Worst(each.label, each.number, told, seconds, as_webp(painter.picture(frame), quality=70)))
    return found


def _verdict(lines: Sequence[TrackerResult], sections: Sequence[Section]) -> Verdict:
    """`sections` of all recordings, if they are known."""
    contexts = [evaluation.configuration.context for line in lines for evaluation in line.evaluations]
    budgets = {(context.get("budget") or {}).get("equal_ms") for context in contexts}
    homes = {section.matched_model for section in sections}
    return verdict(
        lines, next(iter(budgets)) if len(budgets) == 1 else None, next(iter(homes)) if len(homes) == 1 else ()
    )


def _template() -> Any:
    pages = Environment(loader=PackageLoader("depthtrack.report", "page"), autoescape=True, trim_blocks=True)
    pages.lstrip_blocks = True
    return pages.get_template("report.html.jinja")
