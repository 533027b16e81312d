"""`depthtrack markers link`: join points to trajectories without a model."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from depthtrack.cli.argument_checks import CAPTURE
from depthtrack.cli.markers.capture_options import CaptureOptions
from depthtrack.cli.stated_default import number


@dataclass(frozen=True)
class Command:
    """Join the points of a capture to trajectories, without models and names.

    The trajectories of the file are not used. To score the result: `depthtrack evaluate FILE --labels CAPTURE`.
    """

    capture: tyro.conf.OmitArgPrefixes[CaptureOptions]
    out: Annotated[Path, CAPTURE, tyro.conf.arg(aliases=("-o",), metavar="FILE")]
    """Capture to write: .csv, .c3d or .trc."""
    longest_gap: Annotated[float, number(0, 3600)] = 1.0
    """Longest gap over which trajectories are joined, seconds; 0 joins none."""
    json: bool = False
    """Print figures as JSON instead of a sentence."""

    def run(self) -> None:
        from depthtrack.markers.formats.registry import write_capture
        from depthtrack.markers.labelling.linking import LinkingOptions, link_capture
        from depthtrack.strict_data import json_text

        linked = link_capture(self.capture.read(), LinkingOptions(longest_gap=self.longest_gap))
        write_capture(self.out, linked)
        figures = {"frames": len(linked), "rate_hz": linked.rate, "trajectories": len(linked.labels)}
        text = f"{self.out}: {len(linked)} frames, {len(linked.labels)} trajectories"
        print(json_text({"file": str(self.out), **figures}) if self.json else text)
