"""Options of calibration. Those without a source were tuned on synthetic recordings."""

from dataclasses import dataclass, replace

from depthtrack.options import option
from depthtrack.tracking.configuration import HybridConfig
from depthtrack.tracking.stretches import StretchOptions


@dataclass(frozen=True)
class ViewChoiceOptions:
    """Choice of the frames that the scale of a rig is measured on."""

    views: int = option(16, "Frames used, at most", unit="frames")
    inspected: int = option(240, "Frames that are segmented, at most, spread over the whole recording", unit="frames")
    finger_half_breadth: float = option(0.013, "Radius of a disc that fits into a palm and into no finger", unit="m")
    fewest: int = option(3, "Frames with a hand below which calibration is refused", unit="frames")


@dataclass(frozen=True)
class JointFitOptions:
    """Weights and steps of the joint optimisation of sizes and poses."""

    kernel_scale: tuple[float, float] = option(
        (0.020, 0.006), "Scale of the Geman-McClure kernel in the first and in the last iteration", unit="m"
    )
    noise: float = option(0.0015, "Standard deviation of one patch of skin about the model, in the best case", unit="m")
    misfit: float = option(
        2.5, "The same in median distances to the skin: errors that no sizes remove do not average out over views"
    )
    step_spread: tuple[float, float, float] = option(
        (0.03, 0.2, 0.3),
        "Standard deviation of a step in translation, rotation and angles; keeps what the view does not determine",
        unit="m, rad, rad",
    )
    joint_places: tuple[float, float, float] = option(
        (0.006, 0.003, 0.002),
        "Standard deviation of the places of a finger's joints in its flesh, base to tip, beside that of hand sizes",
        unit="m",
        source="chosen on the tuning seeds of the cross-model benchmark",
    )
    palm_flesh: float = option(0.1, "Standard deviation of the logarithm of the palm's thickness, beside that of sizes")
    displaced_misfit: float = option(
        1.0, "`misfit` while the displacement of the skin is fitted, which removes such errors"
    )
    displacement: float = option(
        0.003, "Standard deviation of the skin's displacement from that of the sizes", unit="m"
    )
    displacement_difference: float = option(
        0.002, "Standard deviation of the difference between neighbouring nodes of the displacement", unit="m"
    )
    largest_change: float = option(
        0.08, "Change of the logarithm of a size in one iteration; the skin is linear within about that"
    )
    rebuilt: float = option(
        0.02, "Stretch of the skin from the sizes that it was built for, from which on it is built again"
    )


@dataclass(frozen=True)
class AcceptanceOptions:
    """Views that take part in a measurement, and the hand that they must show."""

    good_views: float = option(0.7, "Share of the views that are fitted: those with the lowest energies", most=1)
    hand_like: float = option(
        0.55,
        "Agreement of silhouettes below which no hand was found",
        source="1 minus the silhouette term of Oikonomidis et al. 2011, Eq. (2)",
    )


_SEARCHED_TWICE = HybridConfig(search=replace(HybridConfig().search, attempts=2, min_gain=0.1))
"""Tracker of a hand to be measured: all depends on its starts, which fit an average hand less well."""


@dataclass(frozen=True)
class CalibrationOptions:
    """Rounds of tracking and joint optimisation, and the acceptance of a result."""

    stretches: StretchOptions = option(
        StretchOptions(views=40, tracker=_SEARCHED_TWICE), "Frames that the hand is tracked in"
    )
    first_scales: tuple[float, ...] = option(
        (0.72, 0.8, 0.9, 1.0, 1.1, 1.22),
        "Sizes of the whole hand, of the average one's, that are compared in the first frames of the stretches; empty: "
        "begin with the average",
    )
    first_confidence: float = option(
        0.6,
        "Least confidence of a start in these frames that the track of a stretch begins with",
        source="`grasp` 19 and `random` 1045 of the cross-model benchmark",
        most=1,
    )
    rounds: int = option(3, "Rounds of joint optimisation, at most; the hand is tracked in the first two")
    iterations: int = option(5, "Iterations of the joint optimisation in each round")
    exact_iterations: int = option(3, "Last iterations, which stretch the skin of the sizes found so far")
    skin_rounds: int = option(2, "Fits of the skin's displacement; without any, the skin follows from the sizes")
    skin_iterations: int = option(6, "Iterations of each")
    converged: float = option(0.015, "Change of the logarithm of scale and lengths that ends the rounds")
    fewest: int = option(3, "Views with a hand below which calibration is refused", unit="frames")
    accepted: AcceptanceOptions = option(AcceptanceOptions(good_views=1.0), "Accepted views")
    sure_margin: float = option(0.3, "Share by which the other side costs more if the side is certain")
    size_weight: float = option(
        2.0,
        "Exponent of the uncommonness of the sizes of a side in its cost; 0 leaves it out",
        source="measured as in tools/tune_side.py, on 59 recordings of the cross-model benchmark",
        most=10,
    )
    joint: JointFitOptions = option(JointFitOptions(), "Joint optimisation")


@dataclass(frozen=True)
class OngoingOptions:
    """Measurements of a hand while it is tracked."""

    first_scales: tuple[float, ...] = option(
        (0.72, 0.8, 0.9, 1.0, 1.1, 1.22),
        "Sizes of the whole hand, of the average one's, that are compared before the first measurement; empty: none",
    )
    scale_begin: float = option(
        0.3, "Visible time at which the comparison begins; the first measurement begins with its result", unit="s"
    )
    begin: float = option(1.5, "Visible time at which the first measurement begins", unit="s")
    period: float = option(
        2.0, "Visible time from its begin to its use, when the next begins; it doubles when the hand stays", unit="s"
    )
    view_period: float = option(
        0.1, "Visible time between two views at first; it doubles when the views are full", unit="s"
    )
    longest_step: float = option(0.1, "Time that one frame adds to the visible time, at most", unit="s")
    views: int = option(16, "Views kept of each side, at most", unit="frames")
    fewest: int = option(3, "Views below which no size is measured", unit="frames")
    iterations: int = option(8, "Iterations of the joint optimisation in each measurement")
    least_change: float = option(0.01, "Change of the logarithm of scale or of a length below which the hand stays")
    lead_margin: float = option(0.1, "Share by which the energy of a side is higher when the other one takes its place")
    sure_margin: float = option(0.25, "Share by which the other side's energy is higher if the side is certain")
    sure_after: float = option(4.0, "Visible time before which both sides are tracked", unit="s")
    kept_evidence: float = option(0.5, "Share of the energies so far that still count after a measurement")
    accepted: AcceptanceOptions = option(AcceptanceOptions(), "Accepted views")
    joint: JointFitOptions = option(JointFitOptions(), "Joint optimisation")


@dataclass(frozen=True)
class RigCalibrationOptions:
    """Search for the scale of a rigged hand, and the acceptance of a result."""

    first: int = option(4, "Views with the most open hands, on which scales are tried")
    tried_scales: tuple[float, ...] = option((0.76, 0.9, 1.06, 1.24), "Multiples of the rig's scale that are tried")
    resolution: int = option(96, "Longest side of the image in which poses are searched", unit="px")
    accepted: AcceptanceOptions = option(AcceptanceOptions(), "Accepted views")
    side_margin: float = option(0.02, "Share by which the other side may fit better than that of the rig")


@dataclass(frozen=True)
class MarkerCalibrationOptions:
    """Calibration of marker offsets and hand sizes on a labelled capture."""

    frames: int = option(60, "Frames used, at most: those whose postures differ most", unit="frames")
    inspected: int = option(200, "Frames that are fitted and compared for that", unit="frames")
    good_share: float = option(0.7, "Share of these frames that are used at most: those that a hand fits best")
    least_confidence: float = option(0.8, "Labels of a lower confidence are not used")
    fewest: int = option(8, "Frames below which calibration is refused", unit="frames")
    least_share: float = option(0.7, "Smallest share of the markers that a frame must show")
    noise: float = option(0.0015, "Standard deviation of a marker about the moving hand: skin motion", unit="m")
    kernel_scale: float = option(0.012, "Scale of the Geman-McClure kernel, against wrong labels", unit="m")
    across: float = option(0.5, "Spread of an offset away from the skin, as a share of that along it")
    widening: float = option(20.0, "Factor of the spread of postures along the synergies: they hardly count")
    residual: float = option(3.0, "Standard deviation of an angle about the synergies", unit="rad")
    iterations: int = option(20, "Largest number of Gauss-Newton steps")
    halvings: int = option(6, "Lengths tried for a step")
    tolerance: float = option(1e-5, "Relative decrease of the energy that ends the iterations")
    step_spread: tuple[float, float, float] = option(
        (0.05, 0.5, 0.5),
        "Standard deviation of a step in translation, rotation and angles; keeps what a frame does not determine",
        unit="m, rad, rad",
    )
