"""Options about how a recording is read, beside its camera."""

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

from depthtrack.cli.stated_default import number, stated_default

if TYPE_CHECKING:
    from depthtrack.recording.reading import ReadingOptions


@dataclass(frozen=True)
class ReadingArguments:
    """How recordings are read; the fields are those of `ReadingOptions`."""

    depth_topic: Annotated[str | None, stated_default(metavar="TOPIC")] = None
    """Topic of the depth images in a bag or MCAP file (default: the one found by its type)."""
    colour_topic: Annotated[str | None, stated_default(metavar="TOPIC")] = None
    """Topic of the colour images in a bag or MCAP file (default: the one found by its type)."""

    time_unit: Literal["auto", "s", "ms", "us", "ns", "frames", "index"] = "auto"
    """Unit of the times in lists. `frames` are numbers of frames at 30 Hz; `index` ignores the times."""
    depth_scale: Annotated[float | None, number(1e-6, 0.1, metavar="METRES")] = None
    """Length of one unit of the stored depth: 0.001 for millimetres, 0.0002 for TUM RGB-D (default: that of the
    recording or of the camera)."""
    invalid: Annotated[tuple[int, ...], number(0, 65535, metavar="VALUE...")] = ()
    """Stored depth values that mean no reading, beside 0."""
    mirror: bool = False
    """Mirror the images left to right. The camera is that of the mirrored images."""
    depth_only: bool = False
    """Ignore colour."""
    distortion: Annotated[tuple[float, ...], number(-10_000, 10_000, metavar="K1 K2 P1 P2 K3...")] = ()
    """Lens distortion of the given camera, to be removed (default: that of the camera file)."""

    @property
    def options(self) -> "ReadingOptions":
        """The options as the readers take them."""
        from depthtrack.recording.reading import ReadingOptions

        return ReadingOptions(**asdict(self))

    @classmethod
    def of(cls, options: "ReadingOptions") -> Any:
        """Return the arguments that stand for options."""
        return cls(**asdict(options))
