"""Options of scoring: the objective of Oikonomidis et al. 2011 and its renderer."""

from dataclasses import dataclass
from typing import Any, Literal

from depthtrack.errors import InputError
from depthtrack.options import option

RendererName = Literal["raster", "egl", "osmesa", "oracle"]

_OIKONOMIDIS = "Oikonomidis et al. 2011, Sec. 2.3"


@dataclass(frozen=True)
class Objective:
    """Constants of Oikonomidis et al. 2011, Eq. (1) and (2).

    Raises:
        InputError: if a depth, the unit or epsilon is not above 0 and at most 10, or the cost not within 0 to 100.
    """

    match_depth: float = option(0.01, "d_m: depths closer than this match", unit="m", source=_OIKONOMIDIS)
    clamp_depth: float = option(0.04, "d_M: larger depth differences cost no more", unit="m", source=_OIKONOMIDIS)
    silhouette_weight: float = option(20.0, "lambda: weight of the silhouette term", source=_OIKONOMIDIS)
    kinematic_weight: float = option(10.0, "lambda_k: weight of crossing fingers", source=_OIKONOMIDIS)
    depth_unit: float = option(
        0.001, "Unit of the depth term; in millimetres its clamp of 40 is of the size of lambda = 20", unit="m"
    )
    epsilon: float = option(1e-6, "Keeps the quotients of Eq. (2) finite")
    hidden_depth: float = option(
        0.005,
        "Depth behind an occluder from which it hides the hand: above a sensor's noise, below a finger's radius",
        unit="m",
    )
    before_cost: float = option(
        1.0,
        "Further cost of a pixel drawn before or inside an occluder, in costs of a pixel outside the silhouette",
    )

    def __post_init__(self) -> None:
        for name in ("match_depth", "clamp_depth", "depth_unit", "epsilon", "hidden_depth"):
            if not 0 < getattr(self, name) <= 10:
                raise InputError(f"objective {name} must be above 0 and at most 10, found {getattr(self, name)!r}")
        if not 0 <= self.before_cost <= 100:
            raise InputError(f"objective before_cost must lie between 0 and 100, found {self.before_cost!r}")

    @property
    def clamp(self) -> float:
        """The depth term of a completely wrong pixel; energy thresholds are multiples of it."""
        return self.clamp_depth / self.depth_unit

    def combine(self, depth: Any, silhouette: Any, kinematic: Any) -> Any:
        """Return the energies of Eq. (1) from its separate terms."""
        return depth + self.silhouette_weight * silhouette + self.kinematic_weight * kinematic


@dataclass(frozen=True)
class ScoringOptions:
    """How hypotheses are rendered and scored."""

    renderer: RendererName = option("raster", "Backend that renders and scores hypotheses")
    resolution: int | None = option(
        None, "Longest side of the region that hypotheses are rendered at; the sensor's own if absent", unit="px"
    )
    objective: Objective = option(Objective(), "Objective function", advanced=True)

    def __post_init__(self) -> None:
        if self.resolution is not None and self.resolution < 1:
            raise InputError(f"the resolution must be at least 1 pixel, found {self.resolution}")
