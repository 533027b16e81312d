"""`depthtrack markers cut`: cut stretches out of the trajectories of a capture."""

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
    """Cut stretches out of visible markers, so that gap filling can be compared with them.

    Fill the result, and compare it with the capture: `depthtrack evaluate FOLDER --labels CAPTURE`.
    """

    capture: tyro.conf.OmitArgPrefixes[CaptureOptions]
    out: Annotated[Path, CAPTURE, tyro.conf.arg(aliases=("-o",), metavar="FILE")]
    """Capture to write: .csv, .c3d or .trc."""
    frames: Annotated[tuple[int, int], number(1, 10**7, metavar="FRAMES FRAMES")] = (16, 57)
    """Shortest and longest stretch."""
    share: Annotated[float, number(0, 100, metavar="PERCENT")] = 5.0
    """Share of the labelled samples to cut."""
    seed: Annotated[int, number(0, MOST_SEED)] = 0
    """Seed of the places."""

    def run(self) -> None:
        import numpy as np

        from depthtrack.markers.formats.registry import write_capture
        from depthtrack.options import check_seed
        from depthtrack.synthesis.recorded_capture import cut_stretches

        check_seed(self.seed)
        whole = self.capture.read()
        cut = cut_stretches(whole, self.frames, self.share / 100, self.seed)
        write_capture(self.out, cut)
        lost = int(np.isfinite(whole.positions[..., 0]).sum() - np.isfinite(cut.positions[..., 0]).sum())
        print(f"{self.out}: {lost} samples cut in stretches of {self.frames[0]} to {self.frames[1]} frames")
