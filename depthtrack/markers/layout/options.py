"""Options of the search for a reduced marker layout."""

from dataclasses import dataclass

from depthtrack.errors import InputError
from depthtrack.options import option
from depthtrack.solver.options import SwarmOptions

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
class QualityOptions:
    """Objective of a layout (Eq. 7) and the subspace that it is for."""

    key_frames: int = option(10, "Postures that the objective is evaluated in", source=f"{_PAPER}, Sec. 5.2: 3 to 10")
    components: int = option(
        6, "Synergies l of the subspace, at most; no more than markers", source=f"{_PAPER}, Sec. 3.2: 3 to 6"
    )
    condition_weight: float = option(0.1, "Weight w1 of the condition number", source=f"{_PAPER}, Sec. 5.1")
    distance_weight: float = option(100.0, "Weight w2 of the least distance", source=f"{_PAPER}, Sec. 5.1")
    occlusion_weight: float = option(0.0, "Weight of the share of samples that too few cameras see; 0 for none")
    anchored: bool = option(
        True, "The position of the hand is known from a marker at the wrist; otherwise the layout determines it too"
    )
    robust: bool = option(False, "Count the condition number after the loss of the worst marker")

    def __post_init__(self) -> None:
        if not (1 <= self.key_frames <= 1000 and 1 <= self.components <= 20):
            raise InputError(
                "a layout needs 1 to 1000 key-frames and 1 to 20 components, "
                f"found {self.key_frames} and {self.components}"
            )
        if min(self.condition_weight, self.distance_weight, self.occlusion_weight) < 0:
            raise InputError("the weights of the objective of a layout must not be negative")


@dataclass(frozen=True)
class LayoutOptions:
    """The search for a layout."""

    feasible: FeasibleOptions = option(FeasibleOptions(), "Feasible places")
    quality: QualityOptions = option(QualityOptions(), "Objective")
    swarm: SwarmOptions = option(
        SwarmOptions(particles=1000, generations=100), f"Particle swarm ({_PAPER}, Sec. 5.2)", advanced=True
    )
    exchange: bool = option(True, "Exchange single markers after the swarm until no exchange improves the layout")
    kicks: int = option(10, "Times that three markers of the best layout are moved at random, and exchanged again")
