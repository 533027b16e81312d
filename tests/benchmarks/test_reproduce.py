"""Test the reproduction of figures: files, resumption, registry, command."""

import csv
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from depthtrack.benchmarks.papers.experiment import Experiment, ExperimentOptions, PaperComparison
from depthtrack.benchmarks.papers.registry import (
    EXPERIMENTS,
    SHORT_NAMES,
    chosen_experiments,
    full_cell,
    load_experiment,
    measure_cell,
)
from depthtrack.benchmarks.papers.reproduce import reproduce
from depthtrack.cli import main
from depthtrack.errors import InputError
from depthtrack.evaluation.sweep.local import LocalWorkers
from depthtrack.evaluation.sweep.rows import Row
from tests.support.workers import InThisProcess

TINY = ExperimentOptions(quick=True, repetitions=1, resolution=32, frames=2)
TIMES = ("seconds", "ms_per_frame", "ms")
FIGURES = [name for name in EXPERIMENTS if "-" in name]
MEASURED = [name for name in FIGURES if not name.startswith("schroeder2015-") or name.endswith("table1")]
"""Those that are cheap enough to measure; `test_schroeder2015` has the others on made-up rows."""
SWARM = [name for name in EXPERIMENTS if name.startswith("oikonomidis-")]


def untimed(rows: list[Row]) -> list[Row]:
    return [{name: value for name, value in row.items() if name not in TIMES} for row in rows]


def test_a_worker_of_another_version_is_rejected() -> None:
    cell = full_cell(load_experiment("oikonomidis-2b"), load_experiment("oikonomidis-2b").cells(TINY)[0])
    with pytest.raises(InputError, match=r"the sweep needs depthtrack 0\.0\.7"):
        measure_cell(cell | {"version": "0.0.7"})


@pytest.mark.parametrize("name", MEASURED)
def test_an_experiment_writes_rows_table_summary_and_figure(name: str, tmp_path: Path) -> None:
    experiment = load_experiment(name)
    few = Experiment(**(vars(experiment) | {"cells": lambda options: experiment.cells(options)[:3]}))
    # The first sign is held within 30 frames.
    options = replace(TINY, frames=30) if name == "schroeder-11" else TINY
    done = reproduce(few, options, tmp_path, InThisProcess())
    rows = [json.loads(line) for line in (tmp_path / "rows.jsonl").read_text().splitlines()]
    assert len(rows) == done.cells == len(few.cells(options))
    assert len({tuple(row) for row in rows}) == 1
    assert {"figure", "version", "seconds"} < set(rows[0])
    assert {"error_mm", "error_deg"} & set(rows[0])
    assert done.cell_seconds == pytest.approx(sum(row["seconds"] for row in rows), abs=1e-3)
    assert json.loads((tmp_path / "summary.json").read_text()) == json.loads(json.dumps(done.to_json()))
    with (tmp_path / "table.csv").open() as file:
        table = list(csv.DictReader(file))
    assert [{k: str("" if v is None else v) for k, v in line.items()} for line in done.table] == table
    picture = cv2.imread(str(tmp_path / "figure.png"))
    assert picture is not None
    assert min(picture.shape[:2]) > 600
    ours = np.all(np.abs(picture.astype(int) - (0xB2, 0x72, 0x00)) < 12, axis=-1)
    assert ours.sum() > 60
    assert sorted(path.name for path in tmp_path.iterdir()) == ["figure.png", "rows.jsonl", "summary.json", "table.csv"]


def test_processes_give_the_same_bits_and_a_cut_sweep_continues(tmp_path: Path) -> None:
    experiment = load_experiment("oikonomidis-2b")
    serial = reproduce(experiment, TINY, tmp_path / "serial", InThisProcess())
    cut = tmp_path / "cut"
    cut.mkdir()
    (cut / "rows.jsonl").write_bytes((tmp_path / "serial" / "rows.jsonl").read_bytes()[:900])
    calls: list[tuple[int, int]] = []

    def progress(rows: Any, total: int, reused: int) -> Any:
        calls.append((total, reused))
        return rows

    shared = reproduce(experiment, TINY, cut, LocalWorkers(2), progress)
    assert calls == [(5, 1)]
    assert (serial.reused, shared.reused) == (0, 1)
    assert untimed(shared.table) == untimed(serial.table)
    read = [
        [json.loads(line) for line in (folder / "rows.jsonl").read_text().splitlines()]
        for folder in (cut, tmp_path / "serial")
    ]
    by_distance = [sorted(untimed(rows), key=lambda row: row["distance_m"]) for rows in read]
    assert by_distance[0] == by_distance[1]


def test_experiments_by_name() -> None:
    assert [each.name for each in chosen_experiments(["all"])] == FIGURES
    assert [each.name for each in chosen_experiments(["fig4", "oikonomidis-2a", "oikonomidis-4"])] == [
        "oikonomidis-4",
        "oikonomidis-2a",
    ]
    assert SHORT_NAMES["fig2c"] == "oikonomidis-2c"
    assert (SHORT_NAMES["fig8"], SHORT_NAMES["sec6c"]) == ("schroeder-8", "schroeder-sec6c")
    assert (SHORT_NAMES["fig9"], SHORT_NAMES["table1"]) == ("schroeder-9", "schroeder2015-table1")
    assert len(SHORT_NAMES) == len({name.partition("-")[2] for name in FIGURES})
    assert [each.name for each in chosen_experiments(["oikonomidis", "fig2a"])] == SWARM
    with pytest.raises(InputError, match=r"no figure 'fig5'.*oikonomidis, schroeder.*fig2a \(oikonomidis-2a\)"):
        chosen_experiments(["fig5"])


def test_the_command_prints_text_and_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tiny = ["--quick", "--repetitions", "1", "--resolution", "32", "--frames", "1", "--jobs", "1", "-o", str(tmp_path)]
    assert main(["reproduce", "fig2b", *tiny, "--json"]) == 0
    (summary,) = json.loads(capsys.readouterr().out)
    assert summary == json.loads((tmp_path / "oikonomidis-2b" / "summary.json").read_text())
    assert summary["options"]["frames"] == 1
    assert [line["distance_m"] for line in summary["table"]] == [0.5, 1.0, 1.5, 2.0, 2.5]
    assert main(["reproduce", "oikonomidis-2b", *tiny]) == 0
    text = capsys.readouterr().out
    assert "5 cells, 5 of them reused" in text
    assert "at most 7.5 mm" in text
    assert f"{summary['comparisons'][1]['ours']:.3g} mm" in text


def test_the_command_lists_figures_and_rejects_invalid_options(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["reproduce", "list"]) == 0
    assert "oikonomidis-2a   800 cells  Error against particles and generations" in capsys.readouterr().out
    for arguments, hint in (
        (["fig2b"], "-o DIR"),
        (["-o", str(tmp_path)], "expected figures"),
        (["fig99", "-o", str(tmp_path)], "no figure 'fig99'"),
        (["fig2b", "-o", str(tmp_path), "--jobs", "0"], "--jobs"),
        (["fig2b", "-o", str(tmp_path), "--frames", "0", "--jobs", "1"], "--frames must be from 1"),
    ):
        assert main(["reproduce", *arguments]) == 2
        assert hint in capsys.readouterr().err


@pytest.mark.parametrize(
    ("ours", "unit", "text"),
    [(None, "Hz", "-"), (0.03712, "deg", "0.0371 deg"), (8320.4, "Hz", "8,320 Hz"), (200.0, "", "200")],
)
def test_a_measured_figure_has_three_digits_and_its_unit(ours: float | None, unit: str, text: str) -> None:
    assert PaperComparison("figure", "1", ours, unit).ours_text == text
