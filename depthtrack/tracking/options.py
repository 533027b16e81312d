"""Options of the stages of a tracker; needs no numpy, so that `--help` stays fast.

Energies are multiples of `Objective.clamp`, the energy of a pixel that disagrees completely.
"""

import math
from dataclasses import dataclass, replace

from depthtrack.errors import InputError
from depthtrack.options import check_ranges, option
from depthtrack.solver.options import IcpOptions, LiftOptions, SurfaceFitOptions, SurfaceName, SwarmOptions

Spread = tuple[float, float, float]
"""Standard deviations of position, rotation and angles."""


def damped_swarm(particles: int, generations: int) -> SwarmOptions:
    """Return a swarm with more damping than Eq. (3).

    Half of its randomised angles lie near the best particle. Both changes reduced the error in experiments.
    """
    return SwarmOptions(particles, generations, inertia=0.6, near_best=0.5)


@dataclass(frozen=True)
class TrackingThresholds:
    """Conditions for a trusted pose, and for one that guides the segmentation.

    The median term adapts to hands whose shape differs from the model: their energy is high in every frame.
    """

    confidence: float = option(
        0.025,
        "A start with a lower confidence is lost, and a track with a lower geometric mean of the last two",
        source="half of the lowest confidence of a good pose among the tuning recordings of the cross-model benchmark",
        most=1,
    )
    agreement: float = option(0.5, "A track with a lower agreement of the silhouettes is lost", most=1)
    energy: float = option(
        0.4,
        "A track is lost if its energy exceeds this and also `lost_ratio` times the median",
        unit="clamp",
        most=math.inf,
    )
    lost_ratio: float = option(2.0, "Multiple of the median energy that a trusted pose may have")
    guide_agreement: float = option(0.6, "Least agreement of a pose that guides the segmentation", most=1)
    guide_ratio: float = option(1.3, "Multiple of the median energy that a guiding pose may have")
    sure_confidence: float = option(
        0.3, "Confidence from which on a pose is trusted, and guides the segmentation, whatever its energy", most=1
    )
    median_frames: int = option(30, "Trusted frames that the median energy is taken over", unit="frames", least=1)
    memory: float = option(0.5, "Time after a loss in which the hand is searched near its last pose", unit="s")
    search_interval: float = option(
        0.1, "Time after a search without success until the next one; it doubles each time", unit="s", least=1e-3
    )
    longest_interval: float = option(1.0, "Longest time between two searches of a lost hand", unit="s", least=1e-3)
    longest_gap: float = option(
        0.3,
        "Time without a pose after which a start competes with the last pose, and no motion is predicted",
        unit="s",
        most=math.inf,
    )
    doubt_confidence: float = option(
        0.25,
        "A track that stays below this confidence for `doubt_after` is in doubt: a start competes with it. "
        "One also competes with such a pose after a loss; none does with a deadline",
        source="twelve tuning recordings of the cross-model benchmark, ten of them along the forearm",
        most=1,
    )
    doubt_after: float = option(
        0.3, "Time of low confidence until the first start competes; it doubles each time", unit="s", least=1e-3
    )
    longest_doubt: float = option(5.0, "Longest time between two such starts", unit="s", least=1e-3)
    doubt_margin: float = option(
        0.05, "Energy by which a start must be better than a track in doubt", unit="clamp", most=100
    )
    fastest: float = option(
        4.0,
        "Speed of a palm, beside half a hand's length, beyond which a pose is of another hand: the track is lost",
        unit="m/s",
        most=math.inf,
    )
    start_shifts: tuple[float, ...] = option(
        (-0.03, 0.03),
        "Distances along the hand by which a start is moved, to be fitted there too; empty: none",
        unit="m",
        source="starts in single frames of the tuning seeds 0 to 5 of the cross-model benchmark",
        least=-1,
        most=1,
    )
    start_bends: tuple[float, ...] = option(
        (0.5,),
        "Angles by which all fingers of a start are bent further, to be fitted there too; empty: none",
        unit="rad",
        source="`grasp` 1037 of the cross-model benchmark, checked on its tuning seeds",
        least=-3,
        most=3,
    )
    start_oppositions: tuple[float, ...] = option(
        (0.3,),
        "Angles by which the thumb of a start is opposed further, to be fitted there too; empty: none",
        unit="rad",
        source="`grasp` 1047, 1049 and tuning seed 11 of the cross-model benchmark, checked on its tuning seeds",
        least=-3,
        most=3,
    )
    start_confidence: float = option(
        0.6,
        "A start with a lower confidence tries other places of the hand",
        source="234 single frames of 78 tuning recordings of the cross-model benchmark",
        most=1,
    )
    start_energy: float = option(
        0.5,
        "A start with a higher energy tries other places too; infinite: never",
        unit="clamp",
        source="as `start_confidence`",
        most=math.inf,
    )
    start_confidence_weight: float = option(
        0.5,
        "Energy that a confidence of 1 makes up for among places",
        unit="clamp",
        source="as `start_confidence`",
        most=100,
    )
    place_cost: float = option(
        2.0,
        "Energy of a metre of cost of a place, see `detection`",
        unit="clamp",
        source="as `start_confidence`",
        most=1000,
    )

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class SwarmRound:
    """One round of a search by swarms: the best `starts` poses continue, each as a swarm."""

    starts: int = option(48, "Poses that continue", least=1)
    swarm: SwarmOptions = option(damped_swarm(32, 12), "Swarm around each pose")
    spread: tuple[float, float, float] = option(
        (0.015, 0.3, 0.3), "Standard deviation of the first generation: position, rotation, angles", unit="m, rad, rad"
    )


@dataclass(frozen=True)
class SwarmSearchOptions:
    """Search by rounds of fewer and finer swarms (Oikonomidis et al. 2011, Sec. 3)."""

    rounds: tuple[SwarmRound, ...] = option(
        (
            SwarmRound(),
            SwarmRound(6, damped_swarm(64, 20), (0.010, 0.15, 0.2)),
            SwarmRound(1, damped_swarm(64, 40), (0.005, 0.08, 0.1)),
        ),
        "Rounds of the search",
    )
    refined: int = option(16, "Poses that the surface fit refines after each round")
    refine: bool = option(True, "Fit surfaces between the rounds")
    fit: SurfaceFitOptions = option(
        SurfaceFitOptions(subsample=6, icp=IcpOptions(icp_iterations=8)), "Surface fit between the rounds"
    )


@dataclass(frozen=True)
class FitRound:
    """Round of a coarse-to-fine fit: fit the best `keep` poses in `synergies` dimensions."""

    keep: int = option(48, "Poses that continue", least=1)
    synergies: int | None = option(8, "Synergies that are solved for; all angles if absent", least=1, most=20)
    icp_iterations: int = option(3, "Rounds of correspondences", least=1, most=1000)
    coarse: bool = option(False, "Use a quarter of the points")


@dataclass(frozen=True)
class FitSearchOptions:
    """Search by rounds of surface fits of fewer poses (after Schroeder et al. 2014, Sec. V-B)."""

    rounds: tuple[FitRound, ...] = option(
        (FitRound(48, 8, 3), FitRound(16, None, 4), FitRound(6, None, 8), FitRound(2, None, 12)), "Rounds"
    )


@dataclass(frozen=True)
class GlobalSearchOptions:
    """Global search without a known pose, over the orientations that the forearm allows."""

    proposals: int = option(4000, "Poses scored first", least=1, most=1000000)
    resolution: int | None = option(
        None, "Longest side at which they are rendered; that of the scorer if absent", unit="pixels", least=1
    )
    min_angle: float = option(0.5, "Least angle between the orientations that continue", unit="rad")
    synergy_share: float = option(0.0, "Share of the proposals whose angles are drawn from the synergies", most=1)
    position_spread: Spread = option(
        (0.025, 0.025, 0.012),
        "Standard deviation of the palm about the observed centre, along the camera's axes",
        unit="m",
    )
    angle_spread: float = option(0.15, "Standard deviation of the angles about typical postures", unit="rad")
    follow_arm: bool = option(True, "Prefer orientations that the observed forearm allows")
    least_along_arm: float = option(
        0.17, "Cosine of the largest bend of a wrist, 80 degrees", source="Greene and Heckman 1994", least=-1, most=1
    )
    good_energy: float = option(0.2, "An energy that ends the search", unit="clamp")
    good_ratio: float = option(0.0, "Multiple of the track's median energy that ends the search too")
    attempts: int = option(3, "Repetitions, at most", least=1, most=1000)
    min_gain: float = option(0.0, "Relative gain of a repetition below which the search ends")

    def accepted_energy(self, clamp: float, median_energy: float) -> float:
        """Return the energy that ends the search.

        median_energy: that of the track; infinity without a track.
        """
        usual = self.good_ratio * median_energy if self.good_ratio > 0 and math.isfinite(median_energy) else 0.0
        return max(self.good_energy * clamp, usual)


@dataclass(frozen=True)
class RecoveryOptions:
    """Local search of frames that fit poorly: triggers, proposals and acceptance.

    Ratios compare the energy of the new pose with that of the old one.
    """

    good_energy: float = option(0.2, "Frames with a lower energy are left alone", unit="clamp")
    every: int = option(
        5, "Search locally in every n-th frame if its energy is elevated; 0 only in doubtful frames", unit="frames"
    )
    proposals: int = option(4000, "Poses near the last one that a local search scores", least=1, most=1000000)
    routine_proposals: int = option(
        300, "Poses that it scores in a frame that is not doubtful, if it is smaller there", least=1, most=1000000
    )
    resolution: int | None = option(
        64, "Longest side at which they are rendered; that of the scorer if absent", unit="pixels", least=1
    )
    elevated_ratio: float = option(
        0.0, "Multiple of the track's median energy above which an energy is elevated; 0: any is"
    )
    position_spread: float = option(0.02, "Standard deviation of their position", unit="m")
    rotation_spread: float = option(0.3, "Standard deviation of their rotation", unit="rad")
    angle_spread: float = option(0.15, "Standard deviation of their angles about typical postures", unit="rad")
    keep_angles_every: int = option(4, "Every n-th of them keeps the finger angles", least=1)
    min_angle: float = option(0.1, "Least angle between the orientations that continue; 0 for any", unit="rad")
    accept_local: float = option(0.93, "Energy ratio below which a pose of a routine local search is accepted")
    accept_global: float = option(0.75, "Energy ratio below which a pose from elsewhere is accepted")
    accept_finger: float = option(
        0.98, "Energy ratio below which another posture of a visible finger is accepted; 0 tries none"
    )
    accept_hidden: float = option(0.8, "The same of a finger that is hidden but for less than `fingers.seen_share`")
    accept_shift: float = option(0.9, "Energy ratio below which fingers shifted by one place are accepted")
    doubt_agreement: float = option(0.6, "A lower agreement triggers a local search", most=1)
    doubt_energy: float = option(0.3, "A higher energy triggers a local search", unit="clamp", most=math.inf)

    @property
    def routine(self) -> "RecoveryOptions":
        """The options with the number of proposals of a smaller search."""
        return replace(self, proposals=self.routine_proposals)


@dataclass(frozen=True)
class FingerOptions:
    """Search of the posture of a single finger."""

    proposals: int = option(96, "Postures of one finger that are scored together", least=1, most=100000)
    kept: int = option(8, "Postures that lead to the next ones", least=1)
    spreads: tuple[float, ...] = option((0.2, 0.1), "Standard deviations of the following postures", unit="rad")
    resolution: int | None = option(
        None, "Longest side at which they are rendered; that of the scorer if absent", least=1
    )
    stop_early: bool = option(True, "Stop as soon as the energy is good")
    seen_share: float = option(0.3, "Visible share of a finger from which on its posture can be seen", most=1)
    shift_iterations: int = option(
        0, "Rounds of a first, coarse fit of shifted fingers; 0: one full fit at once", most=1000
    )
    shift_margin: float = option(1.1, "Energy ratio below which a coarse fit of shifted fingers is continued")
    turns: int = option(1, "Frames over which the fingers and the shifts are searched in turn", unit="frames", least=1)
    usual_turns: int = option(1, "The same in frames whose energy is not elevated", unit="frames", least=1)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class BranchOptions:
    """Alternatives to the tracked pose that are followed beside it."""

    interval: float = option(1.0, "Time between two searches for alternatives; 0: never", unit="s")
    search: GlobalSearchOptions = option(
        GlobalSearchOptions(proposals=400, resolution=64, synergy_share=0.5), "Proposals of such a search"
    )
    turned: int = option(32, "Postures in which the tracked hand is turned over", most=100000)
    fits: FitSearchOptions = option(
        FitSearchOptions((FitRound(16, None, 2, coarse=True), FitRound(2, None, 6))), "Surface fits of such a search"
    )
    coarse_every: int = option(16, "The coarse fits of such a search use every n-th point", least=1, most=1000)
    hopeless: float = option(3.0, "Energy ratio to the tracked pose above which a coarse fit is not continued", least=1)
    least_distance: float = option(0.015, "Least mean distance of its joints from those of the tracked pose", unit="m")
    carried: int = option(2, "Alternatives that are followed, at most", most=1000)
    admit: float = option(1.3, "Energy ratio to the tracked pose below which an alternative is followed")
    give_up: float = option(1.4, "Mean energy ratio above which it is given up")
    decide_after: float = option(0.3, "Time that an alternative is followed before it may be accepted", unit="s")
    accept_at_once: float = option(0.75, "Mean energy ratio below which it replaces the tracked pose before")
    accept: float = option(0.93, "Mean energy ratio below which it replaces the tracked pose")
    accept_late: float = option(1.1, "Mean energy ratio above which it is given up after that time")
    longest: float = option(0.9, "Longest time that an alternative is followed", unit="s")


@dataclass(frozen=True)
class SynergyOptions:
    """Hand synergies that a fit uses (Schroeder et al. 2014, Sec. V)."""

    synergies: str | None = option(None, "Set of synergies: leap, leap-grasps, or a file of `depthtrack synergies fit`")
    components: int | None = option(None, "Use only the first n synergies", least=1, most=20)
    synergy_prior: bool = option(False, "Solve for all angles with the synergies as a prior instead of a subspace")

    def __post_init__(self) -> None:
        for name in ("components", "synergy_prior"):
            if getattr(self, name) and self.synergies is None:
                raise InputError(f"{name} needs synergies: choose a set with --synergies")


@dataclass(frozen=True)
class SurfaceChoiceOptions:
    """Choice of the surface that the fits of a frame use."""

    surfaces: tuple[SurfaceName, ...] = option(
        ("skin", "primitives"), "Surfaces to choose from, the preferred one first"
    )
    good_residual: float = option(0.02, "Residual below which no other surface is tried; robust cost, 0 to 1", most=1)
    iterations: int = option(3, "Rounds of correspondences of each brief fit", least=1, most=1000)
    scale: float = option(0.004, "Scale of the robust cost that compares the fits", unit="m", least=1e-4)
    accept: float = option(0.85, "Residual ratio below which another surface than the preferred one is used")


@dataclass(frozen=True)
class KeypointOptions:
    """Proposals from keypoints of another detector: at starts, and if the pose contradicts them.

    The robust cost of keypoints lies between 0, on their lines of sight, and 1.
    """

    lift: LiftOptions = option(LiftOptions(), "Fit of the hand to keypoints and the depth near them")
    contradicted: float = option(
        0.25, "Robust cost of the keypoints above which they are lifted to other poses", most=1
    )
    finger: float = option(0.5, "Robust cost of a finger's keypoints above which its lifted angles are tried", most=1)
    accept: float = option(0.75, "Energy ratio below which a lifted pose is accepted")
    tie: float = option(0.1, "Share of its energy that the robust cost of 1 adds to a pose that is compared")


@dataclass(frozen=True)
class SwarmProposalOptions:
    """Small swarm with surface fits of its best particles."""

    swarm: SwarmOptions = option(damped_swarm(32, 8), "Swarm of each frame")
    spread: Spread = option(
        (0.006, 0.06, 0.15),
        "Standard deviation of the first generation: position, rotation, angles",
        unit="m, rad, rad",
    )
    keep: int = option(2, "Particles that are fitted", least=1)
    accept: float = option(0.97, "Energy ratio below which a fitted particle is accepted")
    skip_ratio: float = option(1.1, "Skip the swarm in frames whose energy is lower than this multiple of the last one")
