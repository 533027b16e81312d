"""Registry of the experiments, which are imported on use."""

from collections.abc import Sequence
from importlib import import_module

from depthtrack import __version__
from depthtrack.benchmarks.papers.experiment import Experiment
from depthtrack.errors import InputError
from depthtrack.evaluation.sweep.rows import Cell, Row

_HERE = "depthtrack.benchmarks.papers"
EXPERIMENTS = {
    "oikonomidis-2a": f"{_HERE}.oikonomidis_2a",
    "oikonomidis-2b": f"{_HERE}.oikonomidis_2b",
    "oikonomidis-2c": f"{_HERE}.oikonomidis_2c",
    "oikonomidis-2d": f"{_HERE}.oikonomidis_2d",
    "oikonomidis-4": f"{_HERE}.oikonomidis_4",
    "schroeder-7": f"{_HERE}.schroeder_7",
    "schroeder-8": f"{_HERE}.schroeder_8",
    "schroeder-9": f"{_HERE}.schroeder_9",
    "schroeder-10": f"{_HERE}.schroeder_10",
    "schroeder-11": f"{_HERE}.schroeder_11",
    "schroeder-sec6c": f"{_HERE}.schroeder_sec6c",
    "maycock-6": f"{_HERE}.maycock_6",
    "schroeder2015-9": f"{_HERE}.schroeder2015_9",
    "schroeder2015-10": f"{_HERE}.schroeder2015_10",
    "schroeder2015-11": f"{_HERE}.schroeder2015_11",
    "schroeder2015-14": f"{_HERE}.schroeder2015_14",
    "schroeder2015-table1": f"{_HERE}.schroeder2015_table1",
    "crossmodel": "depthtrack.benchmarks.crossmodel.experiment",
}
"""Modules with an `EXPERIMENT`; those of papers by the first author and the figure or section."""
_FIGURES = [name for name in EXPERIMENTS if "-" in name]

PAPERS = tuple(dict.fromkeys(name.partition("-")[0] for name in _FIGURES))
"""Names of the papers: their first authors."""

SHORT_NAMES = {
    f"fig{tail}" if tail[0].isdigit() else tail: name
    for name, tail in ((name, name.rpartition("-")[2]) for name in reversed(_FIGURES))
}
"""Full names by figure, section or table; one that two papers have is that of the earlier paper in the list."""


def load_experiment(name: str) -> Experiment:
    """Return the experiment of a full name."""
    experiment: Experiment = import_module(EXPERIMENTS[name]).EXPERIMENT
    return experiment


def chosen_experiments(names: Sequence[str]) -> list[Experiment]:
    """Return experiments by full or short name, by author, or `all` of the papers.

    Raises:
        InputError: if a name is unknown.
    """
    found: list[str] = []
    for name in names:
        full = SHORT_NAMES.get(name, name)
        full = next((each for each in _FIGURES if each.replace("-", "") == name), full)
        if name == "all" or name in PAPERS:
            found += [each for each in _FIGURES if name == "all" or each.startswith(f"{name}-")]
        elif full in EXPERIMENTS:
            found.append(full)
        else:
            known = ", ".join(f"{short} ({full})" for short, full in SHORT_NAMES.items())
            raise InputError(
                f"there is no figure '{name}': choose all, {', '.join(PAPERS)}, crossmodel, or some of {known}"
            )
    return [load_experiment(name) for name in dict.fromkeys(found)]


def full_cell(experiment: Experiment, cell: Cell) -> Cell:
    """Return a cell with the name of its experiment and the version of the program."""
    return {"figure": experiment.name, "version": __version__} | cell


def measure_cell(cell: Cell) -> Row:
    """Return the measured values of a full cell.

    Raises:
        InputError: if this process has another version of depthtrack.
    """
    arguments = dict(cell)
    figure, version = arguments.pop("figure"), arguments.pop("version")
    if version != __version__:
        raise InputError(f"the sweep needs depthtrack {version}, the worker has {__version__}: install {version}")
    return load_experiment(figure).measure(**arguments)
