"""Options of the surface grid, and of the part of a frame that it covers."""

from dataclasses import dataclass

from depthtrack.errors import InputError
from depthtrack.options import check_ranges, option


@dataclass(frozen=True)
class GridOptions:
    """Resolution and connectivity of the surface grid."""

    max_jump: float = option(
        0.03,
        "Depth step between connected neighbours; 5 mm nodes stay connected on surfaces up to 80 degrees oblique",
        unit="m",
        least=1e-4,
    )
    node_size: float = option(0.005, "Width of a node: a third of a finger's breadth", unit="m", least=1e-4)
    start_columns: int = option(
        160, "Nodes across the image if the distance of the hand is unknown", least=1, most=10000
    )
    least_depth_share: float = option(
        0.25, "Share of a node's block that must have a reading within the depth range", most=1
    )
    least_skin_share: float = option(0.25, "Share of a node's block that must have the colour of skin", most=1)
    least_blind_share: float = option(
        0.5, "Share of a node's block that must lack readings, and be skin, for the forearm to vanish there", most=1
    )
    closing_radius: int = option(
        2, "Radius of the closing of skin nodes, across shadows and highlights", unit="nodes", most=100
    )

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class SearchWindowOptions:
    """Part of the depth range and of the image that is searched without a prior."""

    nearest: float = option(0.1, "Smallest distance from the camera at which a hand is searched", unit="m", least=1e-4)
    farthest: float = option(
        2.75, "Largest distance at which a hand is searched", unit="m", source="Oikonomidis 2011 tracks up to 2.5 m"
    )
    depth_window: float = option(
        0.25,
        "Half side of the box around the last position in which a hand is followed",
        unit="m",
        source="Oikonomidis 2011, Sec. 2.1",
        advanced=True,
        least=1e-4,
    )
    position_lifetime: float = option(
        0.5, "Age up to which the last position is used: a hand crosses the window in less", unit="s", advanced=True
    )
    lost_lifetime: float = option(
        0.5, "Time that the tracker is lost after which the hand is located anew; 0 never", unit="s", advanced=True
    )

    def __post_init__(self) -> None:
        check_ranges(self)
        if self.farthest <= self.nearest:
            raise InputError(f"farthest must exceed nearest ({self.nearest:g} m), found {self.farthest:g}")
