"""Options of the solvers: surface fitting (ICP) and particle swarms."""

import math
from dataclasses import dataclass
from typing import Literal

from depthtrack.errors import InputError
from depthtrack.options import check_ranges, option

Residual = Literal["point", "plane", "symmetric"]
"""Distance between surface point x and observed point y that a fit minimises.

`point`: x - y (Schroeder et al. 2014, Eq. 3). `plane`: along the hand's normal (Chen and Medioni, "Object modelling by
registration of multiple range images", 1992). `symmetric`: along the mean of both normals, which vanishes on curved
surfaces too (Rusinkiewicz, "A symmetric objective function for ICP", 2019).
"""
SurfaceName = Literal["skin", "cylinders", "primitives"]
"""Surface of the hand that points are matched to.

`skin`: the mesh. `cylinders`: tapered cylinders with round ends, fitted to the skin. `primitives`: the 37 spheres and
cylinders that hypotheses are rendered with.
"""

_SCHROEDER = "Schroeder et al. 2014"


@dataclass(frozen=True)
class IcpOptions:
    """ICP fit of the hand to a point cloud (Schroeder et al. 2014, Sec. IV)."""

    icp_iterations: int = option(
        5, "Rounds of correspondences per fit", source=f"{_SCHROEDER}, Fig. 8", least=1, most=1000
    )
    gn_iterations: int = option(5, "Gauss-Newton steps per round, at most", least=1, most=1000)
    rigid_iterations: int = option(2, "Rounds that first align the hand as a rigid body", most=1000)
    residual: Residual = option(
        "symmetric", "Distance to minimise", source="Rusinkiewicz 2019; point: Schroeder et al. 2014, Eq. (3)"
    )
    kernel_scale: tuple[float, float] = option(
        (0.03, 0.007),
        "Scale of the Geman-McClure robust kernel in the first and the last round; 0 weighs all points alike",
        unit="m",
    )
    max_distance: float = option(0.04, "Largest distance of a correspondence", unit="m", least=1e-4, most=1)
    min_normal_cosine: tuple[float, float] = option(
        (0.25, 0.6),
        "Least cosine between the normals of a correspondence, in the first and the last round",
        least=-1,
        most=1,
    )
    damping: float = option(1e-4, "Damping of the finger angles, per 3000 points", unit="m^2/rad^2", source="Eq. (4)")
    temporal_weight: float = option(
        5e-5,
        "Weight of the prior that holds each angle where it was, per 3000 points; used if posture_weight is 0",
        unit="m^2/rad^2",
    )
    posture_weight: float = option(
        0.0,
        "Weight of the prior that moves angles together as in common postures, per 3000 points; 0 uses none",
        unit="m^2",
        source="1e-4 in the hybrid tracker by the tuning seeds of the cross-model benchmark, as the two options below",
    )
    posture_memory: float = option(
        5.0,
        "Time after which 37 % remain of an unobserved posture's distance from the mean posture",
        unit="s",
        least=1e-4,
    )
    search_share: float = option(
        0.3, "Share of that distance that the prior of a search without a last pose keeps", most=1
    )
    synergy_weight: float = option(
        3e-7, "Weight of the prior towards postures that the synergies make likely", unit="m^2"
    )
    keypoint_weight: float = option(
        0.1, "Weight of a keypoint from elsewhere on its line of sight, per 3000 points; 0 uses none", unit="points"
    )
    keypoint_scale: float = option(
        0.015, "Scale of the robust kernel of their distances from the hand's", unit="m", least=1e-4
    )
    keypoint_trust: tuple[float, float] = option(
        (0.5, 0.75),
        "Agreement of visible parts with keypoints up to which keypoints have no weight, and from which all of it",
        most=1,
    )
    avoid_limits: bool = option(False, "Increase the damping towards joint limits", source=f"{_SCHROEDER}, Sec. IV-B")
    coarse_every: int = option(4, "The rigid alignment uses every n-th point", advanced=True, least=1, most=1000)
    reference_count: float = option(
        3000.0,
        "Points that damping and priors are stated for; they scale with the number of points",
        advanced=True,
        least=1,
        most=1000000,
    )
    pose_damping: float = option(1e-9, "Damping of the global pose", advanced=True)
    align_damping: float = option(1.0, "Damping of the fixed posture during the rigid alignment", advanced=True)

    def __post_init__(self) -> None:
        check_ranges(self)

    def annealed(self, progress: float) -> tuple[float, float]:
        """Return kernel scale (m) and least normal cosine at `progress` (0 to 1) of the rounds.

        Outliers lose influence as the fit improves.
        """
        (first, last), (low, high) = self.kernel_scale, self.min_normal_cosine
        scale = first * (last / first) ** progress if first > 0 and last > 0 else 0.0
        return float(scale), low + progress * (high - low)


PAPER_ICP = IcpOptions(
    rigid_iterations=1,
    residual="point",
    kernel_scale=(0.0, 0.0),
    min_normal_cosine=(0.0, 0.0),
    damping=1e-6,
    temporal_weight=0.0,
    synergy_weight=0.0,
    keypoint_weight=0.0,
    avoid_limits=True,
)
"""Schroeder et al. 2014: point-to-point distances, equal weights, damping of the step, joint limit avoidance."""


@dataclass(frozen=True)
class LiftOptions:
    """Fit of the hand to 2D keypoints and the depth near them."""

    least_keypoints: int = option(8, "Fewer known keypoints are not lifted", least=4, most=21)
    least_confidence: float = option(0.2, "Keypoints of a lower confidence count as unknown", most=1)
    window: float = option(
        0.006, "Half the side of the window whose median depth is read at a keypoint", unit="m", least=1e-4
    )
    farthest: float = option(
        0.12,
        "Readings farther from their median, on an average hand, are those of the background",
        unit="m",
        least=1e-4,
    )
    rounds: int = option(8, "Rounds of robust weights", least=1, most=1000)
    scale: tuple[float, float] = option(
        (0.06, 0.015), "Scale of the Geman-McClure robust kernel in the first and the last round", unit="m", least=1e-4
    )
    along_weight: float = option(0.5, "Weight of the depth of a keypoint, against its place across the line of sight")
    spread: float = option(
        0.006, "Standard deviation of keypoints, which priors are weighed against", unit="m", least=1e-4
    )
    angle_motion: float = option(
        0.35, "Standard deviation of the angles about those of the last frame", unit="rad", least=1e-4
    )

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class SurfaceOptions:
    """Sampling of a surface, and visibility of its points."""

    spacing: float = option(
        0.026,
        "Least distance between points of the skin or the primitives: 2.4 mm on an average hand",
        unit="palm lengths",
        least=1e-3,
        most=1,
    )
    cell: float = option(
        0.004, "Side of an image cell at the hand's distance, a little more than the spacing", unit="m", least=1e-4
    )
    hidden_depth: float = option(
        0.008, "Depth behind the nearest point of its cell at which a point is hidden", unit="m"
    )
    cylinder_hidden_depth: float = option(
        0.006, "Depth behind the rendered hand at which cylinders are hidden", unit="m"
    )
    cylinder_resolution: int = option(96, "Longest side of that rendering", unit="px", least=1)


@dataclass(frozen=True)
class SurfaceFitOptions:
    """Fit of the hand's surface to the point cloud in one stage."""

    surface: SurfaceName = option(
        "skin", "Surface to fit: the skin mesh, tapered cylinders with round ends, or the 37 rendered primitives"
    )
    subsample: int = option(
        3, "Use every n-th point of the cloud", source=f"{_SCHROEDER}, Sec. VI-B", least=1, most=1000
    )
    max_points: int = option(0, "Most points used; a larger cloud is subsampled more. 0: no limit", unit="points")
    icp: IcpOptions = option(IcpOptions(), "Iterative closest points")
    sampling: SurfaceOptions = option(SurfaceOptions(), "Points of the surface", advanced=True)

    def __post_init__(self) -> None:
        check_ranges(self)

    def step(self, count: int) -> int:
        """Return n such that every n-th of `count` points is used."""
        return max(self.subsample, math.ceil(count / self.max_points)) if self.max_points else self.subsample


def constriction(cognitive: float, social: float) -> float:
    """Return Clerc and Kennedy's factor w of Oikonomidis et al. 2011, Eq. (3).

    w = 2 / |2 - psi - sqrt(psi^2 - 4 psi)| with psi = c1 + c2.

    Raises:
        InputError: if psi does not exceed 4.
    """
    psi = cognitive + social
    if psi <= 4:
        raise InputError(f"c1 + c2 of the swarm must exceed 4 (Oikonomidis et al. 2011, Eq. 3), found {psi:g}")
    return 2 / abs(2 - psi - math.sqrt(psi * psi - 4 * psi))


@dataclass(frozen=True)
class SwarmOptions:
    """Particle swarm (Oikonomidis et al. 2011, Sec. 2.4)."""

    particles: int = option(
        64, "Particles of the swarm", source="Oikonomidis et al. 2011, Fig. 2a", least=1, most=100000
    )
    generations: int = option(
        25, "Generations of the swarm", source="Oikonomidis et al. 2011, Fig. 2a", least=1, most=100000
    )
    cognitive: float = option(2.8, "Attraction c1 to the particle's own best", source="Eq. (3)")
    social: float = option(1.3, "Attraction c2 to the swarm's best", source="Eq. (3)")
    inertia: float = option(constriction(2.8, 1.3), "Factor w of the velocity", source="Eq. (3)")
    randomise_every: int = option(3, "Randomise finger angles every n generations; 0 never", source="Sec. 2.4")
    randomise: float = option(0.5, "Share of the particles that are randomised", source="Yasuda et al. 2010", most=1)
    near_best: float = option(
        0.0, "Share of randomised angles drawn near the best instead of over the whole range", most=1
    )
    near_spread: float = option(0.15, "Standard deviation of angles drawn near the best", unit="rad")

    def __post_init__(self) -> None:
        check_ranges(self)
