"""What an experiment is: cells to measure, a table of what came of them, and the paper's word beside it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

from matplotlib.axes import Axes

from depthtrack.errors import InputError
from depthtrack.evaluation.sweep.rows import Cell, Row

QUICK_RESOLUTION = 96


@dataclass(frozen=True)
class ExperimentOptions:
    """What a user may choose; an experiment takes note of what it varies or leaves open.

    `quick`: few cells and repetitions, swarms at a reduced resolution. `repetitions` with different seeds,
    None for the experiment's own number; `resolution` of the region of interest, its longest side in pixels, None for
    the sensor's own (QUICK_RESOLUTION when quick); `frames` at the beginning of the motion, None for all; `synergies`
    in place of the experiment's own, by a name that `load_source` knows.
    """

    quick: bool = False
    variant: Literal["default", "paper"] = "default"
    renderer: str = "raster"
    repetitions: int | None = None
    resolution: int | None = None
    frames: int | None = None
    synergies: str | None = None

    @property
    def side(self) -> int | None:
        """Longest side of the region of interest, pixels; None is the sensor's own."""
        return QUICK_RESOLUTION if self.quick and self.resolution is None else self.resolution

    def seeds(self, own: int, quick: int) -> range:
        """Seeds of the repetitions, where the experiment has `own` of them, or `quick` ones. Raises InputError."""
        count = (quick if self.quick else own) if self.repetitions is None else self.repetitions
        if not 1 <= count <= 10_000:
            raise InputError(f"repetitions must lie between 1 and 10000, found {count}")
        return range(count)


@dataclass(frozen=True)
class PaperComparison:
    """One statement of the paper's text, and what we measured; `ours` None where the cells do not tell."""

    what: str
    paper: str
    ours: float | None
    unit: str

    @property
    def ours_text(self) -> str:
        return "-" if self.ours is None else f"{self.ours:.3g} {self.unit}"


@dataclass(frozen=True)
class Experiment:
    """An experiment of a paper. All its cells have the same names, and so have all its rows, and its table's.

    `measure` is a module-level function of a cell's values, by name, that gives the measured ones. `tabulate` makes
    the table that people read from the rows of all cells, `compare` sets the rows beside the paper's text, `draw`
    plots them on matplotlib axes.
    """

    name: str
    title: str
    source: str
    cells: Callable[[ExperimentOptions], list[Cell]]
    measure: Callable[..., Row]
    tabulate: Callable[[Sequence[Row]], list[Row]]
    compare: Callable[[Sequence[Row]], list[PaperComparison]]
    draw: Callable[[Axes, Sequence[Row]], None]
