"""Options of the segmentation."""

from dataclasses import dataclass

from depthtrack.errors import InputError
from depthtrack.options import option


@dataclass(frozen=True)
class SegmentationOptions:
    """How the hand is cut out of each frame."""

    use_colour: bool = option(True, "Use the colour of recordings that have it; else depth alone")
    skin_model: str | None = option(
        None, "Skin colours from `depthtrack train-skin`; published statistics (Jones and Rehg 2002) if absent"
    )
    wrist_margin: float = option(0.0, "Length of forearm that is kept beyond the wrist", unit="m")

    def __post_init__(self) -> None:
        if not -0.05 <= self.wrist_margin <= 0.2:
            raise InputError(f"wrist_margin must be from -0.05 to 0.2 m, found {self.wrist_margin:g}")
