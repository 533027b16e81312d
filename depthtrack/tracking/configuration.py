"""The configuration of each tracker; needs no numpy, so that `--help` stays fast."""

import math
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

from depthtrack.errors import InputError
from depthtrack.options import check_ranges, option
from depthtrack.ranges import MOST_SEED
from depthtrack.rendering.options import Objective, ScoringOptions
from depthtrack.solver.options import PAPER_ICP, IcpOptions, LiftOptions, SurfaceFitOptions, SurfaceName, SwarmOptions
from depthtrack.tracking.options import (
    BranchOptions,
    FingerOptions,
    FitRound,
    FitSearchOptions,
    GlobalSearchOptions,
    KeypointOptions,
    RecoveryOptions,
    Spread,
    SurfaceChoiceOptions,
    SwarmProposalOptions,
    SwarmRound,
    SwarmSearchOptions,
    SynergyOptions,
    TrackingThresholds,
    damped_swarm,
)

_GLOBAL_FITS = GlobalSearchOptions(proposals=3000, resolution=64, synergy_share=0.5, good_energy=0.3, attempts=1)
"""Global search of the trackers that fit surfaces. A doubtful start searches other places instead of once more."""
_START_FITS = FitSearchOptions(
    (FitRound(48, 8, 3, coarse=True), FitRound(16, None, 4, coarse=True), FitRound(6, None, 8), FitRound(2, None, 12))
)
"""Surface fits of their global search."""
_LOCAL_FITS = FitSearchOptions(
    (FitRound(48, None, 3), FitRound(16, None, 4), FitRound(6, None, 8), FitRound(2, None, 12))
)
"""Surface fits of their local search."""
_FIT_RECOVERY = RecoveryOptions(
    good_energy=0.3, proposals=3000, min_angle=0.0, accept_local=0.9, doubt_agreement=0.5, doubt_energy=0.4
)
"""Conditions of their local search."""
_FIT_FINGERS = FingerOptions(resolution=96, stop_early=False)
"""Search of single fingers."""
_HYBRID_SEARCH = replace(_GLOBAL_FITS, good_ratio=1.2)
"""Global search of the hybrid tracker. A track's median energy states what a good one is."""
_DOUBT_FITS = FitSearchOptions(
    (FitRound(24, None, 3, coarse=True), FitRound(8, None, 4, coarse=True), FitRound(2, None, 8))
)
"""Surface fits of a global search in a doubtful frame, and soon after a loss."""
_HYBRID_RECOVERY = replace(_FIT_RECOVERY, elevated_ratio=1.1)
"""Its conditions of a local search."""
_HYBRID_FINGERS = replace(_FIT_FINGERS, turns=2, usual_turns=6, shift_iterations=3)
"""Its search of single fingers."""
_HYBRID_LOCAL_FITS = FitSearchOptions(
    (FitRound(16, None, 3, coarse=True), FitRound(6, None, 4, coarse=True), FitRound(2, None, 8))
)
"""Surface fits of its local search."""
_ROUTINE_FITS = FitSearchOptions((FitRound(8, None, 3, coarse=True), FitRound(2, None, 4), FitRound(1, None, 6)))
"""Surface fits of its routine local search."""

_DOUBT_SWARMS = SwarmSearchOptions(
    (
        SwarmRound(24, damped_swarm(32, 10)),
        SwarmRound(4, damped_swarm(64, 16), (0.010, 0.15, 0.2)),
        SwarmRound(1, damped_swarm(64, 30), (0.005, 0.08, 0.1)),
    ),
    refined=8,
)
"""Swarms of the PSO tracker's searches in a doubtful frame, and soon after a loss."""
_ROUTINE_SWARMS = SwarmSearchOptions(
    (
        SwarmRound(12, damped_swarm(32, 8)),
        SwarmRound(3, damped_swarm(64, 12), (0.010, 0.15, 0.2)),
        SwarmRound(1, damped_swarm(64, 20), (0.005, 0.08, 0.1)),
    ),
    refined=6,
)
"""Swarms of its routine local search."""


_POSTURE_ICP = IcpOptions(posture_weight=3e-4, keypoint_weight=0.3)
"""Fits with a prior on the posture; keypoints weigh as much more as the prior, which they compete with."""
_PAPER_SCORING = ScoringOptions(objective=Objective(surroundings_depth=math.inf))
"""Scoring of the published trackers: nothing hides the hand."""
_LIKELY_POSTURES = ScoringOptions(objective=Objective(posture_weight=0.04))
"""Scoring of the trackers that fit surfaces: prefers common postures where the images leave a finger open."""


def _check_predictions(shares: tuple[float, ...]) -> None:
    if not shares:
        raise InputError("predictions must be one or more numbers, such as 0 0.5 1, found none")


@dataclass(frozen=True)
class PsoConfig:
    """PSO tracker: a swarm of rendered hypotheses per frame (after Oikonomidis et al. 2011)."""

    name: ClassVar[str] = "pso"

    swarm: SwarmOptions = option(damped_swarm(64, 25), "Swarm of each frame")
    spread: Spread = option(
        (0.004, 0.04, 0.04),
        "Standard deviation of the first generation: position, rotation, angles",
        unit="m, rad, rad",
    )
    widen: float = option(0.5, "Share of the last motion that widens the first generation", advanced=True)
    refine: bool = option(True, "Fit the swarm's best pose to the surface that the points lie on")
    surface_choice: SurfaceChoiceOptions = option(SurfaceChoiceOptions(), "Choice of that surface", advanced=True)
    final_fit: SurfaceFitOptions = option(
        SurfaceFitOptions(icp=_POSTURE_ICP), "Surface fit of the swarm's best pose", advanced=True
    )
    search: GlobalSearchOptions = option(GlobalSearchOptions(resolution=64), "Global search", advanced=True)
    swarm_search: SwarmSearchOptions = option(SwarmSearchOptions(), "Swarms of a search", advanced=True)
    doubt_search: SwarmSearchOptions = option(_DOUBT_SWARMS, "Swarms of the search of a doubtful frame", advanced=True)
    routine_search: SwarmSearchOptions = option(_ROUTINE_SWARMS, "Swarms of a routine local search", advanced=True)
    recovery: RecoveryOptions = option(
        RecoveryOptions(routine_proposals=2000), "Local re-initialisation", advanced=True
    )
    fingers: FingerOptions = option(FingerOptions(), "Search of single fingers", advanced=True)
    keypoints: KeypointOptions = option(KeypointOptions(), "Keypoints from elsewhere", advanced=True)
    branches: BranchOptions = option(BranchOptions(), "Alternatives followed beside the pose", advanced=True)
    thresholds: TrackingThresholds = option(TrackingThresholds(), "Trust in a pose", advanced=True)
    scoring: ScoringOptions = option(ScoringOptions(), "Rendering and scoring")
    seed: int = option(0, "Seed of the random numbers", most=MOST_SEED)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class IkConfig:
    """IK tracker: the hand's surface fitted to the point cloud (after Schroeder et al. 2014)."""

    name: ClassVar[str] = "ik"

    fit: SurfaceFitOptions = option(SurfaceFitOptions(icp=_POSTURE_ICP), "Surface fit of each frame")
    predictions: tuple[float, ...] = option(
        (0.0, 0.5, 1.0), "Shares of the last motion that are tried as predictions", least=-10, most=10
    )
    retry_ratio: float = option(
        1.3, "Multiple of the last energy above which other predictions are fitted too", advanced=True
    )
    retry_energy: float = option(0.05, "Added to that multiple", unit="clamp", advanced=True)
    synergies: SynergyOptions = option(SynergyOptions(), "Hand synergies")
    search: GlobalSearchOptions = option(
        _GLOBAL_FITS,
        "Global search",
        advanced=True,
    )
    fit_search: FitSearchOptions = option(_START_FITS, "Surface fits of a global search", advanced=True)
    recovery: RecoveryOptions = option(
        replace(_FIT_RECOVERY, routine_proposals=1000),
        "Local re-initialisation",
        advanced=True,
    )
    local_search: FitSearchOptions = option(
        _LOCAL_FITS,
        "Surface fits of a local search",
        advanced=True,
    )
    doubt_search: FitSearchOptions = option(
        _DOUBT_FITS, "Surface fits of the global search of a doubtful frame", advanced=True
    )
    routine_search: FitSearchOptions = option(
        _HYBRID_LOCAL_FITS, "Surface fits of a routine local search", advanced=True
    )
    fingers: FingerOptions = option(_FIT_FINGERS, "Search of single fingers", advanced=True)
    keypoints: KeypointOptions = option(KeypointOptions(), "Keypoints from elsewhere", advanced=True)
    branches: BranchOptions = option(BranchOptions(), "Alternatives followed beside the pose", advanced=True)
    thresholds: TrackingThresholds = option(TrackingThresholds(), "Trust in a pose", advanced=True)
    scoring: ScoringOptions = option(_LIKELY_POSTURES, "Rendering and scoring")
    deadline: float | None = option(
        None,
        "Time after a frame arrives at which its pose is due: searches end before, to go on in the next frames. "
        "Poses then depend on the speed of the machine",
        unit="ms",
        least=0,
        most=3_600_000,
    )
    deadline_reserve: float = option(
        0.15,
        "Share of the deadline that searches leave to the step under way, and to the confidence of the pose",
        advanced=True,
        most=1,
    )
    seed: int = option(0, "Seed of the random numbers", most=MOST_SEED)

    def __post_init__(self) -> None:
        check_ranges(self)
        _check_predictions(self.predictions)


@dataclass(frozen=True)
class HybridConfig:
    """Hybrid tracker: surface fits, and a small swarm with fits of its best particles."""

    name: ClassVar[str] = "hybrid"

    surface_choice: SurfaceChoiceOptions = option(SurfaceChoiceOptions(), "Choice of the surface")
    fit: SurfaceFitOptions = option(SurfaceFitOptions(icp=_POSTURE_ICP), "Surface fit of each frame")
    search_points: int = option(
        3500, "Most points that the fits of searches use; 0: no limit", unit="points", advanced=True
    )
    predictions: tuple[float, ...] = option(
        (0.0, 0.5, 1.0), "Shares of the last motion that are tried as predictions", least=-10, most=10
    )
    retry_ratio: float = option(
        1.3, "Multiple of the last energy above which other predictions are fitted too", advanced=True
    )
    retry_energy: float = option(0.05, "Added to that multiple", unit="clamp", advanced=True)
    proposals: SwarmProposalOptions = option(SwarmProposalOptions(), "Swarm of frames whose energy rises")
    search: GlobalSearchOptions = option(
        _HYBRID_SEARCH,
        "Global search",
        advanced=True,
    )
    fit_search: FitSearchOptions = option(_START_FITS, "Surface fits of a global search", advanced=True)
    doubt_search: FitSearchOptions = option(
        _DOUBT_FITS, "Surface fits of the global search of a doubtful frame", advanced=True
    )
    recovery: RecoveryOptions = option(
        _HYBRID_RECOVERY,
        "Local re-initialisation",
        advanced=True,
    )
    local_search: FitSearchOptions = option(
        _HYBRID_LOCAL_FITS,
        "Surface fits of a local search",
        advanced=True,
    )
    routine_search: FitSearchOptions = option(_ROUTINE_FITS, "Surface fits of a routine local search", advanced=True)
    fingers: FingerOptions = option(_HYBRID_FINGERS, "Search of single fingers", advanced=True)
    keypoints: KeypointOptions = option(KeypointOptions(), "Keypoints from elsewhere", advanced=True)
    branches: BranchOptions = option(BranchOptions(), "Alternatives followed beside the pose", advanced=True)
    thresholds: TrackingThresholds = option(TrackingThresholds(), "Trust in a pose", advanced=True)
    scoring: ScoringOptions = option(_LIKELY_POSTURES, "Rendering and scoring")
    deadline: float | None = option(
        None,
        "Time after a frame arrives at which its pose is due: searches end before, to go on in the next frames. "
        "Poses then depend on the speed of the machine",
        unit="ms",
        least=0,
        most=3_600_000,
    )
    deadline_reserve: float = option(
        0.15,
        "Share of the deadline that searches leave to the step under way, and to the confidence of the pose",
        advanced=True,
        most=1,
    )
    seed: int = option(0, "Seed of the random numbers", most=MOST_SEED)

    def __post_init__(self) -> None:
        check_ranges(self)
        _check_predictions(self.predictions)


_PAPER_THRESHOLDS = TrackingThresholds(
    longest_gap=math.inf,
    doubt_confidence=0,
    start_shifts=(),
    start_bends=(),
    start_oppositions=(),
    start_confidence=0,
    start_energy=math.inf,
)
"""Thresholds of the published trackers: no start is changed, and the last pose is followed after any pause."""


@dataclass(frozen=True)
class Oikonomidis2011Config:
    """PSO tracker as published: 27 raw parameters, one swarm around the last solution."""

    name: ClassVar[str] = "oikonomidis2011"

    swarm: SwarmOptions = option(SwarmOptions(), "Swarm of each frame")
    spread: Spread = option(
        (0.004, 0.04, 0.04),
        "Standard deviation of the first generation: position, rotation, angles",
        unit="m, rad, rad",
    )
    search: GlobalSearchOptions = option(GlobalSearchOptions(follow_arm=False), "Global search", advanced=True)
    swarm_search: SwarmSearchOptions = option(SwarmSearchOptions(refine=False), "Swarms of a search", advanced=True)
    thresholds: TrackingThresholds = option(
        _PAPER_THRESHOLDS,
        "Trust in a pose; not part of the paper",
        advanced=True,
    )
    scoring: ScoringOptions = option(_PAPER_SCORING, "Rendering and scoring")
    seed: int = option(0, "Seed of the random numbers", most=MOST_SEED)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class Schroeder2014Config:
    """IK tracker as published: point to point, linear prediction, joint limit avoidance."""

    name: ClassVar[str] = "schroeder2014"

    fit: SurfaceFitOptions = option(SurfaceFitOptions(icp=PAPER_ICP), "Surface fit of each frame")
    synergies: SynergyOptions = option(SynergyOptions(), "Hand synergies")
    search: GlobalSearchOptions = option(
        replace(_GLOBAL_FITS, resolution=None, follow_arm=False, attempts=4, min_gain=0.1),
        "Global search; not part of the paper",
        advanced=True,
    )
    fit_search: FitSearchOptions = option(FitSearchOptions(), "Surface fits of a global search", advanced=True)
    thresholds: TrackingThresholds = option(
        _PAPER_THRESHOLDS,
        "Trust in a pose; not part of the paper",
        advanced=True,
    )
    scoring: ScoringOptions = option(_PAPER_SCORING, "Rendering and scoring")
    seed: int = option(0, "Seed of the random numbers", most=MOST_SEED)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class LiftConfig:
    """Lift: poses from keypoints of another detector and the depth near them."""

    name: ClassVar[str] = "lift"

    lift: LiftOptions = option(LiftOptions(), "Fit of the hand to keypoints and the depth near them")
    refine: bool = option(True, "Fit the lifted pose to the surface, and keep the one with the lower energy")
    fit: SurfaceFitOptions = option(SurfaceFitOptions(), "Surface fit of the lifted pose", advanced=True)
    thresholds: TrackingThresholds = option(TrackingThresholds(), "Trust in a pose", advanced=True)
    scoring: ScoringOptions = option(ScoringOptions(), "Rendering and scoring")
    seed: int = option(0, "Seed of the random numbers, which the lift does not use", most=MOST_SEED)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class MarkersConfig:
    """Poses solved from an optical marker capture; `markers.json` states how."""

    name: ClassVar[str] = "markers"

    surface: SurfaceName = option("skin", "Surface that pictures show")
    seed: int = option(0, "Seed of the random numbers, which labelling does not use", most=MOST_SEED)


DEFAULT_TRACKER = "hybrid"

TrackerConfig = HybridConfig | PsoConfig | IkConfig | Oikonomidis2011Config | Schroeder2014Config | LiftConfig
TrackerName = Literal["hybrid", "pso", "ik", "oikonomidis2011", "schroeder2014", "lift"]
CONFIGURATIONS: dict[str, type[TrackerConfig]] = {
    "hybrid": HybridConfig,
    "pso": PsoConfig,
    "ik": IkConfig,
    "oikonomidis2011": Oikonomidis2011Config,
    "schroeder2014": Schroeder2014Config,
    "lift": LiftConfig,
}
"""The trackers of recordings with depth images."""

RunConfig = TrackerConfig | MarkersConfig
RUN_CONFIGURATIONS: dict[str, type[RunConfig]] = {**CONFIGURATIONS, "markers": MarkersConfig}
"""All that writes run folders."""
