"""Options of objects that may hide the hand."""

from dataclasses import dataclass

from depthtrack.options import check_ranges, option


@dataclass(frozen=True)
class OccluderOptions:
    """Objects that may hide the hand, in recordings with colour."""

    find_occluder: bool = option(False, "Find objects that may hide the hand")
    reach_margin: float = option(
        0.03, "Distance beyond the hand's reach up to which readings are an object", unit="m", most=1
    )
    least_breadth: float = option(
        0.01, "Smallest breadth of an object: thinner parts are errors of the hand's outline", unit="m"
    )
    least_area: float = option(2e-4, "Smallest visible area of an object: that of a fingertip", unit="m^2")
    max_jump: float = option(0.03, "Depth step between connected neighbours of a surface", unit="m", least=1e-4)
    border_share: float = option(
        0.5, "Longest border between an object and readings beyond the reach, in square roots of the object's area"
    )
    gap: float = option(
        5 / 640,
        "Largest extension over missing readings at an object's outline, as a share of the image's width",
        source="the dilation of skin, Oikonomidis 2011, Sec. 2.1",
        most=0.1,
    )

    def __post_init__(self) -> None:
        check_ranges(self)
