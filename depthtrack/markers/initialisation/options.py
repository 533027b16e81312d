"""Options of the initialisation."""

from dataclasses import dataclass
from typing import Literal

from depthtrack.errors import InputError
from depthtrack.options import option

_PAPER = "Maycock et al. 2015, Sec. III-A"


@dataclass(frozen=True)
class PaperOptions:
    """Initialisation of Maycock et al. 2015, Sec. III-A."""

    cluster_distance: float = option(
        0.08, "Points nearer to each other than this belong to the same cluster", unit="m", source=_PAPER
    )
    count_weight: float = option(
        1.0, "Factor alpha of the difference in the number of markers, against millimetres", source="Eq. (2)"
    )
    icp_iterations: int = option(30, "Largest number of rigid ICP steps", source=_PAPER)
    scale_limits: tuple[float, float] = option((0.7, 1.4), "Smallest and largest factor from the boxes")
    rounds: int = option(3, "Rounds of assignment and inverse kinematics")


@dataclass(frozen=True)
class SearchOptions:
    """Initialisation by a search over palms and fingers."""

    noise: float = option(0.001, "Standard deviation of a measured point, its marker's spread aside", unit="m")
    missing: float = option(9.0, "Energy of a marker without a point, half a squared deviation")
    coarse: float = option(0.012, "Standard deviation that the steps of the search add", unit="m")
    rotations: int = option(150, "Orientations that each posture is aligned from")
    palms: int = option(60, "Palms whose fingers are searched closely")
    hypotheses: int = option(24, "Assignments that are fitted with unknown sizes")
    widening: float = option(1.5, "Factor of the spread of postures along the synergies")
    residual: float = option(0.25, "Standard deviation of an angle about the synergies", unit="rad")
    temperature: float = option(4.0, "Divides energies that confidence is computed from: their errors are not normal")


@dataclass(frozen=True)
class InitialisationOptions:
    """Which points of a frame are which markers of which model."""

    method: Literal["search", "paper"] = option("search", "Search over palms and fingers, or the method of the paper")
    paper: PaperOptions = option(PaperOptions(), "Method of Maycock et al. 2015", advanced=True)
    search: SearchOptions = option(SearchOptions(), "Search over palms and fingers", advanced=True)

    def __post_init__(self) -> None:
        if self.method not in ("search", "paper"):
            raise InputError(f"the method of a start must be 'search' or 'paper', found {self.method!r}")
