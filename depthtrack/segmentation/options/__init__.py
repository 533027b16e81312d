"""Options of the segmentation, one frozen dataclass per step; importing them needs no numpy."""

from depthtrack.segmentation.options.arm import (
    BreadthOptions,
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
from depthtrack.segmentation.options.segmentation import SegmentationOptions
from depthtrack.segmentation.options.surface import GridOptions, SearchWindowOptions

__all__ = [
    "BreadthOptions",
    "DetectionOptions",
    "FlyingPixelOptions",
    "ForearmOptions",
    "ForeshortenedWristOptions",
    "GridOptions",
    "OccluderOptions",
    "OutlineOptions",
    "PalmOptions",
    "PointCloudOptions",
    "RoiOptions",
    "SearchWindowOptions",
    "SegmentationOptions",
    "SkinColourOptions",
    "WristFilterOptions",
    "WristOptions",
]
