"""`depthtrack calibrate`: the sizes of a hand, from nothing but a recording of it."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from depthtrack.cli.measuring import calibrate_sequence
from depthtrack.cli.recording_options import RecordingOptions
from depthtrack.errors import InputError
from depthtrack.files import write_atomic

if TYPE_CHECKING:
    from depthtrack.calibration.calibrate import Calibration


_MOST_SURE = 0.99
"""The largest confidence told: none is beyond doubt."""


@dataclass(frozen=True)
class Command:
    """Measure the hand of a recording: side, scale, each finger's length and width, and the palm.

    Best on a few seconds of one bare hand that turns, opens and closes before the camera. What the recording does not
    show stays as among people at large; the file tells how sure each size is. Track with it by --hand.
    """

    recording: tyro.conf.OmitArgPrefixes[RecordingOptions]
    out: Annotated[Path, tyro.conf.arg(aliases=("-o",), metavar="HAND.json")]
    """Hand file to write."""
    side: Literal["auto", "right", "left"] = "auto"
    """Which hand it is; both are tried unless given."""
    picture: Annotated[Path | None, tyro.conf.arg(metavar="FILE.png")] = None
    """Picture of average and measured hand over some frames; beside the hand file unless given."""
    skin_model: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """Skin colours learnt by `depthtrack train-skin`; published statistics unless given."""
    seed: int = 0
    """Chooses the random numbers: the same seed gives the same hand."""
    threads: Annotated[int | None, tyro.conf.arg(metavar="N")] = None
    """As many as there are cores unless given. The result does not depend on it."""
    json: bool = False
    """Print JSON instead of text."""

    def run(self) -> None:
        from json import dumps

        from depthtrack.calibration.calibrate import summary
        from depthtrack.segmentation.observation import Segmenter
        from depthtrack.viewing.calibration_picture import calibration_picture
        from depthtrack.viewing.contact_sheet import save_picture

        picture = self.picture or self.out.with_suffix(".png")
        for path in (self.out, picture):
            if not path.parent.is_dir():
                raise InputError(f"the folder {path.parent} does not exist: create it first")
            if path.is_dir():
                raise InputError(f"{path} is a folder: name a file in it")
        sequence = self.recording.open()
        segmenter = Segmenter.for_sequence(sequence, self.skin_model)
        side = None if self.side == "auto" else self.side
        source = f"calibrated on {sequence.name}"
        calibration = calibrate_sequence(sequence, segmenter, side, self.seed, self.threads, source)
        write_atomic(self.out, calibration.to_json())
        save_picture(calibration_picture(calibration), picture)
        report = {**summary(calibration), "hand_file": str(self.out), "picture": str(picture)}
        print(dumps(report, indent=2) if self.json else _text(calibration, self.out, picture))


def _text(calibration: "Calibration", out: Path, picture: Path) -> str:
    hand, margin = calibration.hand, calibration.side_margin
    doubt = "" if calibration.side_sure else ": side not sure; give --side"
    sure = "" if margin is None else f" (the other side fits {100 * margin:.0f} % worse{doubt})"
    before, after, views = calibration.before_mm, calibration.after_mm, len(calibration.observations)
    lines = [
        f"a {hand.side} hand{sure}, {hand.scale:.2f} times the average adult's, from {views} frames",
        f"observed points lie {after:.1f} mm from its skin, {before:.1f} mm from the average hand's",
        f"  {'':16}{'mm':>8}{'± mm':>8}{'confidence':>12}",
        *(
            f"  {name:16}{m.mm:8.1f}{m.sigma_mm:8.1f}{min(m.confidence, _MOST_SURE):12.2f}"
            for name, m in calibration.measured.items()
        ),
        f"look at {picture}; use it:  depthtrack track RECORDING --hand {out}",
    ]
    return "\n".join(lines)
