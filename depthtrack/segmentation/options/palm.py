"""Options of palm candidates, and of the choice among them."""

from dataclasses import dataclass, replace
from typing import Self

from depthtrack.options import check_ranges, option

_CHOSEN = "chosen by hand on 425 single frames, 90 of them real: the hand costs least in 423; no script is kept"
_SMALLEST_AREA = 1e-4
"""Square metres: smallest area that an option may state."""
_TUNED = "single frames of the tuning seeds 0 to 5 of the cross-model benchmark"


@dataclass(frozen=True)
class PalmOptions:
    """Sizes that distinguish palms from heads, elbows and stumps of limbs.

    Lengths along the surface are measured from node to node, which makes them about 8 % too long.
    """

    hand_reach: float = option(
        0.17,
        "Largest distance along the surface from the palm's centre to a fingertip",
        unit="m",
        source="95th percentile of men: hand length 211 mm, less 50 mm of palm; Greiner 1991",
        least=1e-4,
    )
    tip_to_palm: float = option(
        0.15, "Largest distance from a fingertip, or a fist's knuckles, to the palm's centre", unit="m"
    )
    tip_to_wrist: float = option(0.20, "Largest distance from a fingertip to the wrist", unit="m", least=1e-4)
    exit_reach: float = option(
        0.24, "Distance from the palm's centre up to which limbs are searched", unit="m", least=1e-4
    )
    exit_tolerance: float = option(0.01, "Distance before `exit_reach` from which a limb continues", unit="m")
    path_limit: float = option(
        3.0, "Length of the longest path along a surface to one of its tips", unit="m", least=1e-4
    )
    least_area: float = option(
        20e-4,
        "Smallest visible area of a hand: half of a fist seen from its side (40 cm^2)",
        unit="m^2",
        least=_SMALLEST_AREA,
    )
    least_radius: float = option(
        0.012, "Smallest inscribed radius of a palm: half the thickness of a child's palm", unit="m"
    )
    known_share: float = option(
        0.8,
        "Share of `least_area` and `least_radius` that suffices near a known place of the hand",
        source="462 frames of tuning recordings of the cross-model benchmark",
        most=1,
    )
    largest_radius: float = option(
        0.063, "Largest inscribed radius of a palm or fist; the radius of a head is 75 mm", unit="m"
    )
    centre_share: float = option(
        0.9, "Share of the largest inscribed radius from which a node counts for the palm's centre", most=0.99
    )
    limb_area: float = option(10e-4, "Smallest area between hand_reach and exit_reach of a limb", unit="m^2")
    finger_area: float = option(25e-4, "Largest area of a finger between these distances", unit="m^2")
    exit_area: float = option(
        150e-4, "Largest area of an arm between these distances: 8 cm of a 12 cm wide arm, times 1.5", unit="m^2"
    )
    tips_per_surface: int = option(4, "Number of geodesic extrema of a surface that are tried", most=100)
    least_protrusion: float = option(0.05, "Smallest geodesic distance of an extremum from the rest", unit="m")
    finger_half_breadth: float = option(0.013, "Radius of the disc that does not fit into a finger", unit="m")

    def __post_init__(self) -> None:
        check_ranges(self)

    @property
    def at_known_place(self) -> Self:
        """The options for a palm near a known place of the hand, which may be smaller."""
        share = self.known_share
        area = max(share * self.least_area, _SMALLEST_AREA)
        return replace(self, least_area=area, least_radius=share * self.least_radius)


@dataclass(frozen=True)
class DetectionOptions:
    """Weights of the choice among palm candidates, in metres of distance.

    A start chooses among all candidates of the nearest slice of depth; following chooses near the last position.
    """

    slice_depth: float = option(
        0.35, "Thickness of a slice of depth: a hand and a forearm that points away", unit="m", least=1e-4
    )
    slice_step: float = option(
        0.2, "Distance between slices, which are searched from near to far", unit="m", least=1e-4
    )
    largest_step: float = option(0.12, "Largest motion of a palm between frames: 3.6 m/s at 30 Hz", unit="m")
    accepted_cost: float = option(
        0.05, "Cost of a candidate near the last position below which no other is tried", unit="m"
    )
    distance_weight: float = option(0.25, "Cost of a metre of distance from the camera", source=_CHOSEN)
    start_radius_bonus: float = option(5.0, "Bonus of a metre of inscribed radius in a start", source=_CHOSEN)
    rewarded_palm_radius: float = option(
        0.028, "Inscribed radius from which more radius earns no more bonus in a start", unit="m", source=_CHOSEN
    )
    narrow_cost: float = option(
        3.0, "Cost of a metre that a followed palm's inscribed radius lacks to a full palm", source=_CHOSEN
    )
    full_palm_radius: float = option(
        0.042, "Inscribed radius from which a followed palm has no cost of narrowness", unit="m", source=_CHOSEN
    )
    finger_bonus: float = option(0.2, "Bonus of a hand with all fingers visible", unit="m", source=_CHOSEN)
    all_fingers_area: float = option(
        40e-4, "Area of narrow parts with the full bonus", unit="m^2", source=_CHOSEN, least=1e-4
    )
    wrist_cost: float = option(1.5, "Cost of a metre by which the narrowest place is too far away", source=_CHOSEN)
    usual_wrist: float = option(
        0.06, "Distance of the narrowest place from the palm's centre without a cost", unit="m", source=_CHOSEN
    )
    farthest_wrist: float = option(0.21, "Distance beyond which this cost does not grow", unit="m", source=_CHOSEN)
    no_arm_cost: float = option(0.1, "Cost of a candidate without a visible arm", unit="m", source=_CHOSEN)
    alternatives: int = option(6, "Palm candidates that a doubtful start tries, at most", most=100)
    alternative_cost: float = option(
        0.2, "Cost beside that of the first candidate up to which they are tried", unit="m", source=_TUNED
    )
    alternative_shifts: tuple[float, ...] = option(
        (0.04, 0.08), "Distances away from the forearm at which the first palm is tried too", unit="m", source=_TUNED
    )

    def __post_init__(self) -> None:
        check_ranges(self)
