"""The experiments by name; none is imported before it is asked for."""

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
}
"""Modules that hold an `EXPERIMENT`; a name is the paper's first author, and the figure or section."""

PAPERS = tuple(dict.fromkeys(name.partition("-")[0] for name in EXPERIMENTS))

SHORT_NAMES = {
    tail if tail.startswith("sec") else f"fig{tail}": name
    for name, tail in ((name, name.rpartition("-")[2]) for name in EXPERIMENTS)
}
"""Names without the paper's: no two papers here have a figure of the same number."""


def load_experiment(name: str) -> Experiment:
    """The experiment of this full name."""
    experiment: Experiment = import_module(EXPERIMENTS[name]).EXPERIMENT
    return experiment


def chosen_experiments(names: Sequence[str]) -> list[Experiment]:
    """Experiments by full or short name, all of a paper by its author, or `all`; each once.

    Raises InputError for others, naming those there are.
    """
    found: list[str] = []
    for name in names:
        full = SHORT_NAMES.get(name, name)
        if name == "all" or name in PAPERS:
            found += [each for each in EXPERIMENTS if name == "all" or each.startswith(f"{name}-")]
        elif full in EXPERIMENTS:
            found.append(full)
        else:
            known = ", ".join(f"{short} ({full})" for short, full in SHORT_NAMES.items())
            raise InputError(f"no figure '{name}': choose all, {', '.join(PAPERS)}, or some of {known}")
    return [load_experiment(name) for name in dict.fromkeys(found)]


def full_cell(experiment: Experiment, cell: Cell) -> Cell:
    """A cell as workers and journals know it: with the experiment's name, and the version that measures."""
    return {"figure": experiment.name, "version": __version__} | cell


def measure_cell(cell: Cell) -> Row:
    """Measure a full cell. Raises InputError where this process has another version of depthtrack."""
    arguments = dict(cell)
    figure, version = arguments.pop("figure"), arguments.pop("version")
    if version != __version__:
        raise InputError(f"this worker has depthtrack {__version__}, the sweep needs {version}: install that one")
    return load_experiment(figure).measure(**arguments)
