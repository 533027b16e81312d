"""Experiments: cells to measure, the table of their rows, and the comparison with the paper."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

from matplotlib.axes import Axes

from depthtrack.errors import InputError
from depthtrack.evaluation.sweep.rows import Cell, Row

QUICK_RESOLUTION = 96
"""Longest side of the region of interest in a quick version, pixels."""


@dataclass(frozen=True)
class ExperimentOptions:
    """Options of the user; an experiment ignores those that it varies or does not use.

    quick: few cells and repetitions, and swarms at a reduced resolution.
    variant: trackers of this program or those of the papers.
    renderer: renderer of the swarm.
    repetitions: number of seeds; None for the number of the experiment.
    first_seed: seeds that are left out before them.
    resolution: longest side of the region of interest, pixels; None for the sensor's, or QUICK_RESOLUTION if quick.
    frames: number of first frames of the motion; None for all.
    synergies: name for `synergy_sources.load_source`; None for the synergies of the experiment.
    rigs: paths of rigged meshes; hands are drawn at random if there are none.
    split: seeds that thresholds are tuned on, or those that figures are reported for.
    """

    quick: bool = False
    variant: Literal["default", "paper"] = "default"
    renderer: str = "raster"
    repetitions: int | None = None
    first_seed: int = 0
    resolution: int | None = None
    frames: int | None = None
    synergies: str | None = None
    rigs: tuple[str, ...] = ()
    split: Literal["tuning", "report"] = "report"

    @property
    def side(self) -> int | None:
        """Longest side of the region of interest, pixels; None for that of the sensor."""
        return QUICK_RESOLUTION if self.quick and self.resolution is None else self.resolution

    def seeds(self, own: int, quick: int) -> range:
        """Return the seeds of the repetitions.

        own, quick: number of repetitions of the experiment, and of its quick version.

        Raises:
            InputError: if the number is out of range.
        """
        count = (quick if self.quick else own) if self.repetitions is None else self.repetitions
        if not 1 <= count <= 10_000:
            raise InputError(f"--repetitions must be from 1 to 10000, found {count}")
        return range(self.first_seed, self.first_seed + count)


@dataclass(frozen=True)
class PaperComparison:
    """A figure in the text of a paper, and the measured one.

    what: description of the figure.
    paper: figure in the paper.
    ours: measured figure; None if the cells do not contain it.
    """

    what: str
    paper: str
    ours: float | None
    unit: str

    @property
    def ours_text(self) -> str:
        """Measured figure with its unit."""
        if self.ours is None:
            return "-"
        number = f"{self.ours:,.0f}" if abs(self.ours) >= 1000 else f"{self.ours:.3g}"
        return f"{number} {self.unit}".rstrip()


@dataclass(frozen=True)
class Experiment:
    """An experiment. All cells, all rows and all lines of the table have equal keys.

    source: paper and figure.
    cells: returns the cells for the options of the user.
    measure: module-level function that takes the values of a cell by keyword and returns the measured values.
    tabulate: returns the table of the rows of all cells.
    compare: returns the figures of the paper beside those of the rows.
    draw: plots the rows on matplotlib axes.
    reference: heading of the figures of the paper.
    """

    name: str
    title: str
    source: str
    cells: Callable[[ExperimentOptions], list[Cell]]
    measure: Callable[..., Row]
    tabulate: Callable[[Sequence[Row]], list[Row]]
    compare: Callable[[Sequence[Row]], list[PaperComparison]]
    draw: Callable[[Axes, Sequence[Row]], None]
    reference: str = "paper, from its text"
