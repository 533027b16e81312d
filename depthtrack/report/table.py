"""The page's table: one row per tracker and recording, with the best values marked."""

from collections.abc import Sequence
from dataclasses import dataclass

from depthtrack.evaluation.compare.results import Column, TrackerResult, shown_columns
from depthtrack.report.series import TrackerSeries


@dataclass(frozen=True)
class TableCell:
    """A value as text, and whether it is the best of its recording."""

    text: str
    best: bool


@dataclass(frozen=True)
class TableRow:
    """A tracker on a recording; the first row of a recording spans `row_count` rows."""

    series: TrackerSeries
    cells: list[TableCell]
    is_first: bool
    row_count: int


def table_head(results: Sequence[TrackerResult]) -> list[tuple[str, str]]:
    """Return the headings and units of the columns."""
    return [(column.heading, column.unit) for column in shown_columns(results)]


def table_rows(series: Sequence[TrackerSeries]) -> list[TableRow]:
    """Return all rows, grouped by recording."""
    columns = shown_columns([each.result for each in series])
    rows = []
    for source in dict.fromkeys(each.result.source for each in series):
        group = [each for each in series if each.result.source == source]
        best = [_best(column, [each.result for each in group]) for column in columns]
        for number, each in enumerate(group):
            cells = [
                TableCell(_text(column, each.result), best=value is not None and column.value(each.result) == value)
                for column, value in zip(columns, best, strict=True)
            ]
            rows.append(TableRow(each, cells, number == 0, len(group)))
    return rows


def _best(column: Column, results: Sequence[TrackerResult]) -> float | None:
    """Return the best value of a column; None if all are equal."""
    values = [value for result in results if (value := column.value(result)) is not None]
    if len(set(values)) < 2:
        return None
    return max(values) if column.higher_is_better else min(values)


def _text(column: Column, result: TrackerResult) -> str:
    value = column.value(result)
    return "–" if value is None else format(value, column.form)
