"""Options of the steps that label single pixels."""

from dataclasses import dataclass

from depthtrack.errors import InputError
from depthtrack.options import check_ranges, option

_ARGYROS = "Argyros and Lourakis 2004, Sec. 2.1"


@dataclass(frozen=True)
class RoiOptions:
    """Region of interest around the hand, and its segmentation near a tracker's prediction."""

    margin: float = option(0.04, "Margin around the hand, for hypotheses to move in", unit="m", most=1)
    reach_margin: float = option(
        0.03, "Distance that a hand may have moved beyond its prediction", unit="m", advanced=True, most=1
    )
    nearest_centre: float = option(0.05, "Smallest depth of a predicted palm", unit="m", advanced=True, least=1e-4)
    least_readings: int = option(
        30, "Smallest number of depth readings of a hand", unit="pixels", advanced=True, most=1000000
    )
    border_share: float = option(
        0.5,
        "Longest border between a hand's surface and readings beyond its reach, in square roots of the surface's area",
        advanced=True,
    )
    small_component: float = option(
        0.02, "Share of the largest component's area below which a component is noise", advanced=True
    )

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class OutlineOptions:
    """Outline of the silhouette, where depth is least reliable."""

    dilation: float = option(
        5 / 640,
        "Radius of the circular dilation of skin, as a share of the image's width",
        source="Oikonomidis 2011, Sec. 2.1: 5 pixels of 640",
        most=0.1,
    )
    closing_divisor: int = option(
        4, "Ratio of the dilation's radius to that of the closing of readings", least=1, most=100
    )
    smoothing_divisor: int = option(
        2, "Ratio of the dilation's radius to half the side of the smoothing window", least=1, most=100
    )
    majority: int = option(
        85,
        "Pixels of 200 that form a majority: below half, because readings are lost at outlines and never gained",
        most=200,
    )
    node_margin: int = option(2, "Nodes beyond the hand's own that may hold its pixels", unit="nodes", most=100)
    whole_share: float = option(0.9, "Share of a detached component within the hand's reach that makes it hand")

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class SkinColourOptions:
    """Hysteresis thresholds on P(skin | colour), and its adaptation to the light."""

    prior: float = option(
        0.4,
        "P(skin) with the published statistics; more than on web pictures, because only pixels near the hand are "
        "classified",
        source="chosen by hand; web pictures hold about 9 % skin (Jones and Rehg 2002)",
        least=1e-4,
        most=1,
    )
    seed_threshold: float = option(
        0.5, "P(skin | colour) from which a pixel starts a component", source=_ARGYROS, most=1
    )
    growth_threshold: float = option(0.15, "P(skin | colour) from which a pixel extends it", source=_ARGYROS, most=1)
    adaptation_frames: int = option(5, "Number of last frames that adapt the statistics", source=_ARGYROS, most=100)
    offline_weight: float = option(0.8, "Weight of the offline statistics", source=_ARGYROS, most=1)
    adaptation_step: int = option(
        3, "Subsampling of rows and columns for the adaptation", unit="pixels", least=1, most=100
    )
    darkest: float = option(20.0, "Luminance below which noise determines the chroma", unit="of 255")
    brightest: float = option(250.0, "Luminance above which saturation determines the chroma", unit="of 255")

    def __post_init__(self) -> None:
        check_ranges(self)
        if self.prior >= 1:
            raise InputError(f"prior must be below 1, found {self.prior:g}")


@dataclass(frozen=True)
class FlyingPixelOptions:
    """Rejection of flying pixels without colour."""

    steepest: float = option(
        6.0, "Tangent of the angle to the image plane beyond which no surface returns enough light: 80 degrees"
    )

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class PointCloudOptions:
    """Normals of the point cloud."""

    sample_spacing: int = option(2, "Distance between the nine samples of a normal", unit="pixels", least=1, most=100)
    same_surface: float = option(
        0.015, "Largest depth difference of samples on one surface: a finger's breadth", unit="m"
    )

    def __post_init__(self) -> None:
        check_ranges(self)
