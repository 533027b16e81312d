"""Options about how a recording is read, beside its camera."""

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Annotated, Any

from depthtrack.cli.stated_default import stated_default

if TYPE_CHECKING:
    from depthtrack.recording.reading import ReadingOptions


@dataclass(frozen=True)
class ReadingArguments:
    """How recordings are read; the fields are those of `ReadingOptions`."""

    depth_topic: Annotated[str | None, stated_default(metavar="TOPIC")] = None
    """Topic of the depth images in a bag or MCAP file (default: the one found by its type)."""
    colour_topic: Annotated[str | None, stated_default(metavar="TOPIC")] = None
    """Topic of the colour images in a bag or MCAP file (default: the one found by its type)."""

    @property
    def options(self) -> "ReadingOptions":
        """The options as the readers take them."""
        from depthtrack.recording.reading import ReadingOptions

        return ReadingOptions(**asdict(self))

    @classmethod
    def of(cls, options: "ReadingOptions") -> Any:
        """Return the arguments that stand for options."""
        return cls(**asdict(options))
