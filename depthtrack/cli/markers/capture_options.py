"""Options of a capture that commands read."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from depthtrack.cli.stated_default import number, stated_default

if TYPE_CHECKING:
    from depthtrack.markers.capture import MarkerCapture


@dataclass(frozen=True)
class CaptureOptions:
    """The capture and what its file may not state."""

    path: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(name="capture", metavar="CAPTURE")]
    """Marker capture: C3D, Qualisys TSV, Vicon or Motive CSV, TRC, or CSV with columns name-X, name-Y, name-Z."""
    rate: Annotated[float | None, number(0.01, 10**5, metavar="HZ")] = None
    """Frames a second (default: as the file states, else 120)."""
    unit: Annotated[Literal["m", "cm", "mm"] | None, stated_default(metavar="m|cm|mm")] = None
    """Unit of the file (default: as the file states, else the one that fits a hand)."""

    def read(self) -> "MarkerCapture":
        """Read the capture.

        Raises:
            InputError: if the file is missing, damaged or of another format.
        """
        from depthtrack.markers.formats.registry import read_capture

        return read_capture(self.path, self.rate, self.unit)
