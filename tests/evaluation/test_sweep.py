"""Test sweeps: each cell is measured once, although processes die and files are cut."""

import json
import os
import signal
import socket
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.cli import main
from depthtrack.errors import InputError, MissingExtraError
from depthtrack.evaluation.sweep import cluster
from depthtrack.evaluation.sweep.cluster import DaskWorkers
from depthtrack.evaluation.sweep.local import MOST_DEATHS, LocalWorkers
from depthtrack.evaluation.sweep.rows import Cell, Journal, Row
from depthtrack.evaluation.sweep.run import SweepError, Workers, run_sweep
from tests.support.dask import dask_scheduler, dask_workers
from tests.support.workers import InThisProcess

# Two clusters at once would share two cores.
pytestmark = pytest.mark.xdist_group("dask")


def square(cell: Cell) -> Row:
    """Return a square and the number of the process."""
    return {"square": cell["x"] ** 2, "process": os.getpid()}


def deadly_at_first(cell: Cell) -> Row:
    """Return `square`; a cell that names a missing file creates it and kills its worker."""
    time.sleep(0.02)
    if cell["marker"] is not None and not Path(cell["marker"]).exists():
        Path(cell["marker"]).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return square(cell)


def always_deadly(cell: Cell) -> Row:
    os.kill(os.getpid(), signal.SIGKILL)
    return {}


def failing(cell: Cell) -> Row:
    """Raise an error that cannot be pickled."""
    raise MissingExtraError(f"cell {cell['x']}", "sweep")


def sweep(folder: Path, cells: list[Cell], workers: Workers, measure: Any = square) -> list[Row]:
    with Journal(folder / "rows.jsonl", list(cells[0])) as journal:
        return run_sweep(measure, cells, journal, workers)


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Return the address of a scheduler with two worker processes."""
    folder = tmp_path_factory.mktemp("dask")
    with dask_scheduler(folder) as (address, _), dask_workers(address, folder):
        yield address


@pytest.fixture(params=["joblib", "dask"])
def workers(request: pytest.FixtureRequest) -> Workers:
    if request.param == "joblib":
        return LocalWorkers(2)
    return DaskWorkers(request.getfixturevalue("scheduler"))


def test_rows_come_once_and_in_order(tmp_path: Path, workers: Workers) -> None:
    cells: list[Cell] = [{"x": x} for x in range(12)]
    rows = sweep(tmp_path, cells, workers)
    assert [(row["x"], row["square"]) for row in rows] == [(x, x * x) for x in range(12)]
    assert os.getpid() not in {row["process"] for row in rows}
    assert all(row["seconds"] >= 0 for row in rows)
    written = [json.loads(line) for line in (tmp_path / "rows.jsonl").read_text().splitlines()]
    assert sorted(written, key=lambda row: row["x"]) == rows


def test_a_worker_that_kills_itself_loses_no_cell(tmp_path: Path, workers: Workers) -> None:
    cells: list[Cell] = [{"x": x, "marker": str(tmp_path / "died") if x == 5 else None} for x in range(12)]
    rows = sweep(tmp_path, cells, workers, deadly_at_first)
    assert (tmp_path / "died").exists()
    assert [(row["x"], row["square"]) for row in rows] == [(x, x * x) for x in range(12)]
    assert len((tmp_path / "rows.jsonl").read_text().splitlines()) == 12


def test_a_worker_killed_from_outside_loses_no_cell(tmp_path: Path, workers: Workers) -> None:
    """The first worker with a result is killed; others measure its cells."""
    killed: list[int] = []

    def kill_first(rows: Iterator[Row]) -> Iterator[Row]:
        for row in rows:
            if not killed:
                killed.append(row["process"])
                os.kill(row["process"], signal.SIGKILL)
            yield row

    cells: list[Cell] = [{"x": x, "marker": None} for x in range(30)]
    with Journal(tmp_path / "rows.jsonl", ["x", "marker"]) as journal:
        rows = run_sweep(deadly_at_first, cells, journal, workers, kill_first)
    assert [row["square"] for row in rows] == [x * x for x in range(30)]
    assert {row["process"] for row in rows} - set(killed)


def test_a_cell_that_kills_all_workers_stops_the_sweep(tmp_path: Path) -> None:
    with pytest.raises(SweepError, match=rf"killed {MOST_DEATHS} times in a row.*--jobs"):
        sweep(tmp_path, [{"x": 1}], LocalWorkers(2), always_deadly)


def test_the_error_of_a_cell_keeps_its_message(tmp_path: Path, workers: Workers) -> None:
    with pytest.raises(SweepError, match=r"cell 7 .* pip install 'depthtrack\[sweep\]'"):
        sweep(tmp_path, [{"x": 7}], workers, failing)


def test_existing_rows_are_not_measured_again(tmp_path: Path) -> None:
    cells: list[Cell] = [{"x": x} for x in range(6)]
    first = sweep(tmp_path, cells[:4], InThisProcess())
    assert sweep(tmp_path, cells[:4], InThisProcess(), failing) == first
    assert [row["x"] for row in sweep(tmp_path, cells, InThisProcess())] == list(range(6))
    assert len((tmp_path / "rows.jsonl").read_text().splitlines()) == 6


@given(st.data())
def test_a_sweep_continues_wherever_its_file_was_cut(data: st.DataObject) -> None:
    cells: list[Cell] = [{"x": x, "word": "é\n" * x} for x in range(4)]
    with TemporaryDirectory() as name:
        path = Path(name) / "rows.jsonl"
        whole = sweep(path.parent, cells, InThisProcess())
        content = path.read_bytes()
        # The length varies with the digits of the measured seconds.
        kept = data.draw(st.integers(0, 10_000)) % (len(content) + 1)
        path.write_bytes(content[:kept])
        measured: list[int] = []

        def counted(cell: Cell) -> Row:
            measured.append(cell["x"])
            return square(cell)

        again = sweep(path.parent, cells, InThisProcess(), counted)
        assert [row | {"seconds": 0} for row in again] == [row | {"seconds": 0} for row in whole]
        assert measured == list(range(content[:kept].count(b"\n"), 4))
        assert path.read_bytes().count(b"\n") == 4


@pytest.mark.parametrize("damage", ["not JSON", "[1, 2]", '{"x": 1', "\xff"])
def test_a_damaged_file_is_rejected(tmp_path: Path, damage: str) -> None:
    path = tmp_path / "rows.jsonl"
    path.write_bytes(b'{"x": 0}\n' + damage.encode("latin-1") + b"\n")
    with pytest.raises(InputError, match=r"rows\.jsonl, line 2: expected a JSON object"):
        Journal(path, ["x"])


def test_without_dask_the_install_command_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtraError, match=r"depthtrack\[sweep\]"):
        DaskWorkers("tcp://127.0.0.1:1")


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("tcp://127.0.0.1:{port}", "no Dask scheduler answers at '{wrong}'"),
        ("nonsense://{port}", "must have an address as tcp://127.0.0.1:8786, found '{wrong}'"),
    ],
)
def test_an_address_without_scheduler_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], address: str, message: str
) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr(cluster, "TIMEOUT", 0.2)
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        wrong = address.format(port=silent.getsockname()[1])
        assert main(["reproduce", "fig2b", "--quick", "-o", str(tmp_path), "--scheduler", wrong]) == 2
    assert message.format(wrong=wrong) in capsys.readouterr().err


def test_a_scheduler_without_workers_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "TIMEOUT", 1)
    with dask_scheduler(tmp_path) as (address, _), pytest.raises(InputError, match="has no workers"):
        list(DaskWorkers(address).measure(square, [{"x": 1}]))


def test_a_cell_that_kills_all_dask_workers_stops_the_sweep() -> None:
    distributed = pytest.importorskip("distributed")
    import dask

    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 0}),
        distributed.LocalCluster(1, processes=True, threads_per_worker=1, dashboard_address=":0") as local,
    ):
        workers = DaskWorkers(local.scheduler_address)
        with pytest.raises(SweepError, match="killed all its workers"):
            list(workers.measure(always_deadly, [{"x": 1}]))


def test_a_sweep_whose_scheduler_dies_keeps_its_rows(tmp_path: Path) -> None:
    cells: list[Cell] = [{"x": x, "marker": None} for x in range(500)]
    with dask_scheduler(tmp_path) as (address, process), dask_workers(address, tmp_path):

        def kill_scheduler(rows: Iterator[Row]) -> Iterator[Row]:
            for row in rows:
                process.kill()
                yield row

        with (
            Journal(tmp_path / "rows.jsonl", ["x", "marker"]) as journal,
            pytest.raises(SweepError, match="closed: run the same command again"),
        ):
            run_sweep(deadly_at_first, cells, journal, DaskWorkers(address), kill_scheduler)
        assert (tmp_path / "rows.jsonl").read_bytes().count(b"\n") >= 1
    rows = sweep(tmp_path, cells[:40], InThisProcess(), deadly_at_first)
    assert [row["square"] for row in rows] == [x * x for x in range(40)]


@pytest.mark.slow
def test_a_cluster_reproduces_the_figure_of_this_machine(
    tmp_path: Path, scheduler: str, capsys: pytest.CaptureFixture[str]
) -> None:
    tiny = ["reproduce", "fig2b", "--quick", "--repetitions", "1", "--resolution", "32", "--frames", "2", "--json"]
    tables = []
    for where in (["--scheduler", scheduler], ["--jobs", "1"]):
        assert main([*tiny, "-o", str(tmp_path / where[0]), *where]) == 0
        (summary,) = json.loads(capsys.readouterr().out)
        tables.append([{k: v for k, v in line.items() if k != "ms_per_frame"} for line in summary["table"]])
    assert tables[0] == tables[1]
