"""`depthtrack markers shuffle`: strip the labels of a capture."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from depthtrack.cli.argument_checks import CAPTURE
from depthtrack.cli.markers.capture_options import CaptureOptions
from depthtrack.cli.stated_default import number
from depthtrack.ranges import MOST_SEED


@dataclass(frozen=True)
class Command:
    """Strip the labels of a capture, and shuffle its points in every frame.

    Label the result, and compare it with the capture: `depthtrack evaluate FOLDER --labels CAPTURE`.
    """

    capture: tyro.conf.OmitArgPrefixes[CaptureOptions]
    out: Annotated[Path, CAPTURE, tyro.conf.arg(aliases=("-o",), metavar="FILE")]
    """Capture to write: .csv, .c3d or .trc."""
    seed: Annotated[int, number(0, MOST_SEED)] = 0
    """Seed of the order."""

    def run(self) -> None:
        from depthtrack.markers.formats.registry import write_capture
        from depthtrack.options import check_seed
        from depthtrack.synthesis.recorded_capture import strip_labels

        check_seed(self.seed)
        shuffled = strip_labels(self.capture.read(), self.seed)
        write_capture(self.out, shuffled)
        print(f"{self.out}: {len(shuffled)} frames of up to {len(shuffled.labels)} points without labels")
