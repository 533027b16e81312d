"""The page's table: a row a tracker and recording, the best of each recording marked."""

from collections.abc import Sequence
from dataclasses import dataclass

from depthtrack.evaluation.compare.results import Column, TrackerResult, shown_columns
from depthtrack.report.series import TrackerSeries


@dataclass(frozen=True)
class TableCell:
    """A figure as text, and whether it is the best of its recording."""

    text: str
    best: bool


@dataclass(frozen=True)
class TableRow:
    """A tracker on a recording; `first` of its recording, which has `of` rows."""

    shown: TrackerSeries
    cells: list[TableCell]
    first: bool
    of: int


def table_head(lines: Sequence[TrackerResult]) -> list[tuple[str, str]]:
    """Headings and units."""
    return [(column.heading, column.unit) for column in shown_columns(lines)]


def table_rows(shown: Sequence[TrackerSeries]) -> list[TableRow]:
    """All rows, recordings together, in order."""
    columns = shown_columns([each.line for each in shown])
    rows = []
    for source in dict.fromkeys(each.line.source for each in shown):
        group = [each for each in shown if each.line.source == source]
        best = [_best(column, [each.line for each in group]) for column in columns]
        for number, each in enumerate(group):
            cells = [
                TableCell(_text(column, each.line), best=value is not None and column.value(each.line) == value)
                for column, value in zip(columns, best, strict=True)
            ]
            rows.append(TableRow(each, cells, number == 0, len(group)))
    return rows


def _best(column: Column, lines: Sequence[TrackerResult]) -> float | None:
    """The best value of a column; None where it tells nothing apart."""
    values = [value for line in lines if (value := column.value(line)) is not None]
    if len(set(values)) < 2:
        return None
    return max(values) if column.higher_is_better else min(values)


def _text(column: Column, line: TrackerResult) -> str:
    value = column.value(line)
    return "–" if value is None else format(value, column.form)
