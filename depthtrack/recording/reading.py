"""Choices of the user about how a recording is read, beside its camera."""

from dataclasses import dataclass
from typing import Literal

from depthtrack.errors import InputError
from depthtrack.options import option

TimeUnit = Literal["auto", "s", "ms", "us", "ns", "frames", "index"]
_MOST_VALUES, _LARGEST_STORED = 16, 65535


@dataclass(frozen=True)
class ReadingOptions:
    """How a recording is read. A format ignores the options that do not concern it."""

    depth_topic: str | None = option(None, "Topic of the depth images in a bag (default: the one found by its type)")
    colour_topic: str | None = option(None, "Topic of the colour images in a bag (default: the one found by its type)")
    time_unit: TimeUnit = option("auto", "Unit of the times in lists; frames are at 30 Hz, index ignores the times")
    depth_scale: float | None = option(
        None, "Length of one unit of the stored depth, in place of that of the camera", unit="m", least=1e-6, most=0.1
    )
    invalid: tuple[int, ...] = option((), "Stored depth values that mean no reading, beside 0", most=_LARGEST_STORED)
    mirror: bool = option(False, "Mirror the images left to right; the camera is that of the mirrored images")
    depth_only: bool = option(False, "Ignore colour")
    distortion: tuple[float, ...] = option(
        (),
        "Lens distortion of listed images, which is removed: k1 k2 p1 p2 k3 k4 k5 k6, of the given camera",
        least=-10_000,
        most=10_000,
    )

    def __post_init__(self) -> None:
        if len(self.invalid) > _MOST_VALUES or not all(0 <= value <= _LARGEST_STORED for value in self.invalid):
            found = ", ".join(f"{value:.6g}" for value in self.invalid[:_MOST_VALUES])
            raise InputError(
                f"--invalid must be at most {_MOST_VALUES} stored values from 0 to {_LARGEST_STORED}, found {found}"
            )
