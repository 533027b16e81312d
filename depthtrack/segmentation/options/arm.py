"""Options of the forearm and of the wrist."""

from dataclasses import dataclass

from depthtrack.errors import InputError
from depthtrack.options import check_ranges, option


@dataclass(frozen=True)
class ForearmOptions:
    """Evidence for a forearm, and where its direction is measured."""

    least_area: float = option(
        3e-4, "Smallest area of an arm beyond the hand's reach; small, because an arm may point away", unit="m^2"
    )
    least_border: float = option(
        0.04,
        "Smallest length of the image border that an arm crosses",
        unit="m",
        source="between the breadth of two fingers and of a wrist (HandShape: 39 by 57 mm)",
    )
    nearest_border: float = option(
        0.06, "Smallest distance from the palm's centre to where an arm leaves the image", unit="m"
    )
    nearest_gap: float = option(
        0.03,
        "Smallest distance from the palm's centre to where an arm comes too near for the sensor",
        unit="m",
        source="462 frames of tuning recordings of the cross-model benchmark",
    )
    nearer: float = option(
        0.01,
        "Depth by which an arm that vanishes near the sensor is nearer than the palm",
        unit="m",
        source="as `nearest_gap`",
    )
    direction_start: float = option(0.05, "Distance behind the wrist at which the direction is measured", unit="m")
    least_cosine: float = option(0.5, "Cosine of the largest turn of an arm between frames", least=-1, most=1)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class BreadthOptions:
    """Sampling of the breadth of an arm along its axis."""

    half_breadth: float = option(0.07, "Largest distance of a node of the arm from its axis", unit="m")
    bin_width: float = option(0.004, "Distance between samples of the breadth", unit="m", least=1e-4)
    bins: int = option(50, "Number of samples from the palm's centre outward", least=1, most=1000)
    margin_bins: int = option(4, "Samples beyond either end, and half width of the smoothing kernel", least=1, most=100)
    sigma_bins: float = option(
        1.5, "Standard deviation of the smoothing: nodes are about one bin wide", unit="bins", least=1e-4
    )

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class WristOptions:
    """Properties of the wrist: behind it, the forearm is narrow and tapers slowly."""

    breadth: BreadthOptions = option(BreadthOptions(), "Breadth of the arm", advanced=True)
    forearm_from: float = option(0.03, "Distance from which the narrowest place separates hand and elbow", unit="m")
    narrow_ratio: float = option(
        1.09, "Ratio to the narrowest breadth behind it at which the hand ends; some forearms hardly taper", least=1e-4
    )
    broad_ratio: float = option(1.05, "Smallest ratio of the hand's breadth to that of its end")
    broadest_ratio: float = option(1.5, "Ratio from which a broader hand is no better")
    flare_ratio: float = option(1.4, "Largest ratio of breadths behind the wrist; beyond it, the hand follows")
    neighbours: int = option(
        12, "Samples before and behind a place that are compared with it", unit="bins", least=1, most=100
    )
    least_behind: int = option(4, "Samples behind a place that must be visible", unit="bins", most=100)
    place_scale: float = option(0.03, "Distance from the expected place that costs 1", unit="m", least=1e-4)
    breadth_weight: float = option(4.0, "Weight of the ratio of the hand's breadth")
    fade_out: float = option(0.01, "Length at the end of the visible arm where its breadth is unreliable", unit="m")
    axis_section: float = option(0.008, "Half length of the section through the wrist", unit="m")
    palm_section: float = option(0.015, "Half length of the section through the palm", unit="m")
    frontal_palm_radius: float = option(
        0.033,
        "Inscribed radius from which the palm is seen from front or back, with its middle on its axis",
        unit="m",
    )
    shortest_axis: float = option(0.01, "Smallest distance from palm to wrist that defines a direction", unit="m")
    least_bend_cosine: float = option(
        0.94, "Cosine of the largest accepted angle between hand and forearm", least=-1, most=1
    )

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class ForeshortenedWristOptions:
    """The wrist of an arm that points at the camera, by its breadth across the line of sight.

    Ratios were chosen on three grasps of the cross-model benchmark's tuning split that show the hand over its forearm.
    """

    least_cosine: float = option(
        0.85,
        "Cosine of the largest angle between such an arm and the line of sight",
        source="as the ratios",
        least=-1,
        most=1,
    )
    before: float = option(0.16, "Distance before the palm's centre from which the breadth is measured", unit="m")
    half_breadth: float = option(0.08, "Largest distance of a node from the axis", unit="m")
    bin_width: float = option(0.004, "Distance between samples of the breadth", unit="m", least=1e-4)
    bins: int = option(90, "Number of samples", least=1, most=1000)
    margin_bins: int = option(6, "Half width of the smoothing kernel", unit="bins", least=1, most=100)
    sigma_bins: float = option(
        2.5, "Standard deviation of the smoothing: nodes are far apart along the arm", unit="bins", least=1e-4
    )
    narrow_ratio: float = option(1.4, "Ratio to the narrowest breadth behind it at which the hand ends", least=1e-4)
    broad_ratio: float = option(1.2, "Smallest ratio of the hand's breadth to that of its end")
    broadest_ratio: float = option(2.0, "Ratio from which a broader hand is no better")
    flare_ratio: float = option(1.7, "Largest ratio of breadths behind the wrist; beyond it, the hand follows")
    neighbours: int = option(
        12, "Samples before and behind a place that are compared with it", unit="bins", least=1, most=100
    )
    least_behind: int = option(4, "Samples behind a place that must be visible", unit="bins", most=100)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class WristFilterOptions:
    """Kalman filter of the distance from palm to wrist, and its prior from anatomy."""

    edge_on_palm_radius: float = option(
        0.025, "Inscribed radius up to which the palm may be seen edge-on, so that its centre is unreliable", unit="m"
    )
    hand_length: float = option(
        0.18, "Distance along the surface from fingertip to wrist, with fingers slightly bent", unit="m"
    )
    nearest_guess: float = option(0.04, "Smallest distance of an edge-on palm from its wrist by anatomy", unit="m")
    farthest_guess: float = option(0.13, "Largest distance by anatomy", unit="m")
    guess_sigma: float = option(0.035, "Standard deviation of the distance by anatomy", unit="m", least=1e-4)
    step_sigma: float = option(0.0022, "Standard deviation of the wrist's motion along the arm in a frame", unit="m")
    measurement_sigma: float = option(
        0.012, "Standard deviation of a measured wrist; large, because errors persist over frames", unit="m", least=1e-4
    )
    gate: float = option(2.0, "Innovation, in standard deviations, that is clipped; of an edge-on palm, it is rejected")

    def __post_init__(self) -> None:
        check_ranges(self)
        if self.nearest_guess > self.farthest_guess:
            raise InputError(f"nearest_guess must not exceed {self.farthest_guess:g} m, found {self.nearest_guess:g}")
