"""All options of the segmentation, as a run configuration stores them."""

from dataclasses import dataclass

from depthtrack.errors import InputError
from depthtrack.options import check_ranges, option
from depthtrack.segmentation.options.arm import (
    ForearmOptions,
    ForeshortenedWristOptions,
    WristFilterOptions,
    WristOptions,
)
from depthtrack.segmentation.options.occluder import OccluderOptions
from depthtrack.segmentation.options.palm import DetectionOptions, PalmOptions
from depthtrack.segmentation.options.pixels import (
    FlyingPixelOptions,
    OutlineOptions,
    PointCloudOptions,
    RoiOptions,
    SkinColourOptions,
)
from depthtrack.segmentation.options.surface import GridOptions, SearchWindowOptions


@dataclass(frozen=True)
class SegmentationOptions:
    """Segmentation of the hand in each frame."""

    use_colour: bool = option(True, "Use the colour of recordings that have it; else depth alone")
    skin_model: str | None = option(
        None, "File of skin colours from `depthtrack train-skin`; published statistics (Jones and Rehg 2002) if absent"
    )
    skin_from: int | None = option(
        None,
        "Frame of the recording whose hand, found by depth alone, gives the skin colours, as of a glove",
        least=0,
        most=999_999,
    )
    wrist_margin: float = option(
        0.0, "Length of forearm that is kept beyond the wrist", unit="m", least=-0.05, most=0.2
    )
    search: SearchWindowOptions = option(SearchWindowOptions(), "Searched part of a frame")
    roi: RoiOptions = option(RoiOptions(), "Region of interest")
    grid: GridOptions = option(GridOptions(), "Surface grid", advanced=True)
    palm: PalmOptions = option(PalmOptions(), "Palm candidates", advanced=True)
    detection: DetectionOptions = option(DetectionOptions(), "Choice of a palm", advanced=True)
    forearm: ForearmOptions = option(ForearmOptions(), "Forearm", advanced=True)
    wrist: WristOptions = option(WristOptions(), "Wrist", advanced=True)
    foreshortened_wrist: ForeshortenedWristOptions = option(
        ForeshortenedWristOptions(), "Wrist of an arm that points at the camera", advanced=True
    )
    wrist_filter: WristFilterOptions = option(WristFilterOptions(), "Wrist over time", advanced=True)
    outline: OutlineOptions = option(OutlineOptions(), "Outline of the silhouette", advanced=True)
    occluder: OccluderOptions = option(OccluderOptions(), "Objects that may hide the hand", advanced=True)
    skin_colour: SkinColourOptions = option(SkinColourOptions(), "Skin colour", advanced=True)
    flying_pixels: FlyingPixelOptions = option(FlyingPixelOptions(), "Flying pixels", advanced=True)
    point_cloud: PointCloudOptions = option(PointCloudOptions(), "Point cloud", advanced=True)

    def __post_init__(self) -> None:
        check_ranges(self)
        if self.skin_from is not None and self.skin_model is not None:
            raise InputError(f"skin_from must be without a skin_model, found {self.skin_from} and {self.skin_model!r}")
