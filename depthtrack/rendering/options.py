"""Options of scoring: the objective of Oikonomidis et al. 2011 and its renderer."""

import math
from dataclasses import dataclass
from typing import Any, Literal

from depthtrack.options import check_ranges, option

RendererName = Literal["raster", "egl", "osmesa", "oracle"]

_OIKONOMIDIS = "Oikonomidis et al. 2011, Sec. 2.3"


@dataclass(frozen=True)
class Objective:
    """Constants of Oikonomidis et al. 2011, Eq. (1) and (2).

    Raises:
        InputError: if one is out of its range.
    """

    match_depth: float = option(
        0.01, "d_m: depths closer than this match", unit="m", source=_OIKONOMIDIS, least=1e-6, most=10
    )
    clamp_depth: float = option(
        0.04, "d_M: larger depth differences cost no more", unit="m", source=_OIKONOMIDIS, least=1e-6, most=10
    )
    silhouette_weight: float = option(20.0, "lambda: weight of the silhouette term", source=_OIKONOMIDIS, most=10000)
    kinematic_weight: float = option(10.0, "lambda_k: weight of crossing fingers", source=_OIKONOMIDIS, most=10000)
    posture_weight: float = option(
        0.0,
        "Weight of the squared distance from common postures, in their standard deviations; not in Eq. (1)",
        most=100,
    )
    depth_unit: float = option(
        0.001,
        "Unit of the depth term; in millimetres its clamp of 40 is of the size of lambda = 20",
        unit="m",
        least=1e-6,
        most=10,
    )
    epsilon: float = option(1e-6, "Keeps the quotients of Eq. (2) finite", least=1e-12, most=10)
    hidden_depth: float = option(
        0.005,
        "Depth behind an occluder from which it hides the hand: above a sensor's noise, below a finger's radius",
        unit="m",
        least=1e-6,
        most=10,
    )
    surroundings_depth: float = option(
        0.02,
        "Depth behind the readings around the hand, such as the forearm's, from which they hide it; infinite: never",
        unit="m",
        source="half of a wrist's thickness; checked on hands seen along the forearm, see docs/experiments.md",
        least=1e-6,
        most=math.inf,
    )
    before_cost: float = option(
        1.0,
        "Further cost of a pixel drawn before or inside an occluder, in costs of a pixel outside the silhouette",
        most=100,
    )

    def __post_init__(self) -> None:
        check_ranges(self)

    @property
    def clamp(self) -> float:
        """The depth term of a completely wrong pixel; energy thresholds are multiples of it."""
        return self.clamp_depth / self.depth_unit

    def combine(self, depth: Any, silhouette: Any, kinematic: Any) -> Any:
        """Return the energies of Eq. (1) from its separate terms, without the term of postures."""
        return depth + self.silhouette_weight * silhouette + self.kinematic_weight * kinematic


@dataclass(frozen=True)
class ScoringOptions:
    """How hypotheses are rendered and scored."""

    renderer: RendererName = option("raster", "Backend that renders and scores hypotheses")
    resolution: int | None = option(
        None,
        "Longest side of the region that hypotheses are rendered at; the sensor's own if absent",
        unit="px",
        least=1,
    )
    objective: Objective = option(Objective(), "Objective function", advanced=True)

    def __post_init__(self) -> None:
        check_ranges(self)
