"""Options of the search for a reduced marker layout."""

from dataclasses import dataclass
from typing import Literal

from depthtrack.options import check_ranges, option
from depthtrack.solver.options import SwarmOptions

Objective = Literal["expected", "condition"]
"""What a search for a layout minimises.

`expected`: the error that markers with noise leave, for a prior of the postures. `condition`: the condition number in
the subspace of the synergies, less the distance of the markers (Schroeder et al. 2015, Eq. 7).
"""
OBJECTIVES: tuple[Objective, ...] = ("expected", "condition")
_PAPER = "Schroeder et al. 2015"


@dataclass(frozen=True)
class FeasibleOptions:
    """Feasible places of markers on the skin (Sec. 4.2)."""

    back_facing: float = option(
        0.9, "Least cosine between the skin's normal and the back of its bone", source=f"{_PAPER}, Sec. 4.2"
    )
    rigid: float = option(
        0.98,
        "Least skinning weight of one bone; the paper asks for 1, on a skin with narrower transitions",
    )
    radius: float = option(0.003, "Radius of the markers", unit="m")


@dataclass(frozen=True)
class ConditionOptions:
    """Objective `condition` (Eq. 7)."""

    condition_weight: float = option(0.1, "Weight w1 of the condition number", source=f"{_PAPER}, Sec. 5.1")
    distance_weight: float = option(100.0, "Weight w2 of the least distance", source=f"{_PAPER}, Sec. 5.1")
    occlusion_weight: float = option(20.0, "Weight of the share of samples that too few cameras see")

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class ExpectedOptions:
    """Objective `expected`: the root mean square error of the skin, mm."""

    residual: float = option(0.001, "Standard deviation of a coordinate of a marker", unit="m", least=1e-6)
    beyond: float = option(
        0.035, "Standard deviation of each angle about the postures of the motions", unit="rad", least=1e-3
    )
    apart: float = option(0.015, "Distance of two markers below which it counts", unit="m")
    distance_weight: float = option(0.1, "Error that a lack of distance is worth", unit="mm/mm")

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class QualityOptions:
    """Objective of a layout, and the subspace that it is for."""

    objective: Objective = option("expected", "Expected error of all angles, or condition number in the subspace")
    key_frames: int = option(
        10, "Postures that the objective is evaluated in", source=f"{_PAPER}, Sec. 5.2: 3 to 10", least=1, most=1000
    )
    components: int = option(
        6,
        "Synergies l of the subspace, at most; no more than markers",
        source=f"{_PAPER}, Sec. 3.2: 3 to 6",
        least=1,
        most=20,
    )
    anchored: bool = option(
        True, "The position of the hand is known from a marker at the wrist; otherwise the layout determines it too"
    )
    robust: bool = option(False, "Judge a layout after the loss of its worst marker")
    condition: ConditionOptions = option(ConditionOptions(), "Condition number")
    expected: ExpectedOptions = option(ExpectedOptions(), "Expected error")

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class LayoutOptions:
    """The search for a layout."""

    feasible: FeasibleOptions = option(FeasibleOptions(), "Feasible places")
    quality: QualityOptions = option(QualityOptions(), "Objective")
    swarm: SwarmOptions = option(
        SwarmOptions(particles=100, generations=40),
        f"Particle swarm; the paper has 1000 particles and 100 generations ({_PAPER}, Sec. 5.2)",
        advanced=True,
    )
    greedy_particle: bool = option(
        True, "One particle of the swarm begins at the greedy choice; off: all begin at random places, as in the paper"
    )
    exchange: bool = option(True, "Exchange single markers after the swarm until no exchange improves the layout")
    kicks: int = option(10, "Times that three markers of the best layout are moved at random, and exchanged again")
