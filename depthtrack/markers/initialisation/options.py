"""Options of the initialisation."""

from dataclasses import dataclass
from typing import Literal

from depthtrack.errors import InputError
from depthtrack.options import check_ranges, option

_PAPER = "Maycock et al. 2015, Sec. III-A"


@dataclass(frozen=True)
class PaperOptions:
    """Initialisation of Maycock et al. 2015, Sec. III-A."""

    cluster_distance: float = option(
        0.08, "Points nearer to each other than this belong to the same cluster", unit="m", source=_PAPER, least=1e-4
    )
    count_weight: float = option(
        1.0, "Factor alpha of the difference in the number of markers, against millimetres", source="Eq. (2)"
    )
    icp_iterations: int = option(30, "Largest number of rigid ICP steps", source=_PAPER, least=1, most=1000)
    scale_limits: tuple[float, float] = option((0.7, 1.4), "Smallest and largest factor from the boxes", least=0.01)
    rounds: int = option(3, "Rounds of assignment and inverse kinematics", least=1, most=100)


@dataclass(frozen=True)
class SearchOptions:
    """Initialisation by a search over palms and fingers."""

    noise: float = option(
        0.001, "Standard deviation of a measured point, its marker's spread aside", unit="m", least=1e-6
    )
    missing: float = option(8.0, "Energy of a marker without a point, half a squared deviation", most=10000)
    coarse: float = option(0.012, "Standard deviation that the steps of the search add", unit="m", least=1e-6)
    rotations: int = option(150, "Orientations that each posture is aligned from", least=1)
    palms: int = option(60, "Palms whose fingers are searched closely", least=1)
    hypotheses: int = option(24, "Assignments that are fitted with unknown sizes", least=1)
    expansions: int = option(12, "Most assignments whose neighbours are fitted", least=1)
    least_expansions: int = option(2, "Fewest such assignments")
    promising: float = option(4.0, "Energy above the best at which an assignment's neighbours are not fitted")
    widening: float = option(2.0, "Factor of the spread of postures along the synergies", least=1e-4)
    residual: float = option(0.35, "Standard deviation of an angle about the synergies", unit="rad", least=1e-4)
    least_share: float = option(0.5, "Smallest share of the markers of a model that must have points", most=1)
    temperature: float = option(
        1.0, "Divides the energies that the confidence is computed from; 1: as probabilities", least=1e-4
    )
    contested: float = option(1.5, "Factor of the temperature where hands claim the same points", least=1e-4)


@dataclass(frozen=True)
class InitialisationOptions:
    """Assignment of the points of a frame to the markers of models."""

    method: Literal["search", "paper"] = option("search", "Search over palms and fingers, or the method of the paper")
    paper: PaperOptions = option(PaperOptions(), "Method of Maycock et al. 2015", advanced=True)
    search: SearchOptions = option(SearchOptions(), "Search over palms and fingers", advanced=True)

    def __post_init__(self) -> None:
        check_ranges(self)
        if self.method not in ("search", "paper"):
            raise InputError(f"the method of a start must be 'search' or 'paper', found {self.method!r}")
