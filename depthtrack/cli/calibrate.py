"""`depthtrack calibrate`: measure the sizes of a hand on a recording."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from depthtrack.cli.measuring import calibrate_rig_on_sequence, calibrate_sequence
from depthtrack.cli.recording_options import RecordingOptions
from depthtrack.errors import InputError
from depthtrack.files import write_atomic

if TYPE_CHECKING:
    from depthtrack.calibration.calibrate import Calibration
    from depthtrack.calibration.rig_calibration import RigCalibration


_MOST_SURE = 0.99
"""The largest confidence told: none is beyond doubt."""


@dataclass(frozen=True)
class Command:
    """Measure the hand of a recording: side, scale, length and width of each finger, and the palm.

    Best on a few seconds of one bare hand that turns, opens and closes in front of the camera. Sizes that the recording
    does not show stay average; the file gives a confidence for each. Use it with `track --hand`.

    With --hand RIG.glb only the scale of that mesh is measured, and the file refers to it.
    """

    recording: tyro.conf.OmitArgPrefixes[RecordingOptions]
    out: Annotated[Path, tyro.conf.arg(aliases=("-o",), metavar="HAND.json")]
    """Hand file to write."""
    side: Literal["auto", "right", "left"] = "auto"
    """Which hand it is; both are tried unless given."""
    hand: Annotated[Path | None, tyro.conf.arg(metavar="RIG.glb")] = None
    """A rigged mesh (.glb, .gltf) or a hand file of one: measure its scale, and check its side."""
    picture: Annotated[Path | None, tyro.conf.arg(metavar="FILE.png")] = None
    """Picture of the hand before and after over some frames (default: beside the hand file)."""
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
        from depthtrack.hand.hand_file import load_hand
        from depthtrack.segmentation.options import SegmentationOptions
        from depthtrack.viewing.calibration_picture import calibration_picture
        from depthtrack.viewing.contact_sheet import save_picture

        picture = self.picture or self.out.with_suffix(".png")
        for path in (self.out, picture):
            if not path.parent.is_dir():
                raise InputError(f"the folder {path.parent} does not exist: create it first")
            if path.is_dir():
                raise InputError(f"{path} is a folder: name a file in it")
        side = None if self.side == "auto" else self.side
        rig = None if self.hand is None else load_hand(self.hand, side)
        sequence = self.recording.open()
        skin_model = None if self.skin_model is None else str(self.skin_model)
        segmentation = SegmentationOptions(skin_model=skin_model)
        if rig is not None:
            scaled = calibrate_rig_on_sequence(sequence, segmentation, rig, self.seed, self.threads)
            content, page = scaled.to_json(), calibration_picture(scaled, rig)
            report, text = scaled.summary(), _rig_text(scaled, self.out, picture)
        else:
            measured = calibrate_sequence(sequence, segmentation, side, self.seed, self.threads)
            content, page = measured.to_json(), calibration_picture(measured)
            report, text = summary(measured), _text(measured, self.out, picture)
        write_atomic(self.out, content)
        save_picture(page, picture)
        print(dumps({**report, "hand_file": str(self.out), "picture": str(picture)}, indent=2) if self.json else text)


def _rig_text(calibration: "RigCalibration", out: Path, picture: Path) -> str:
    hand = calibration.hand
    return "\n".join(
        [
            f"a {hand.side} hand (the other side fits {100 * calibration.side_margin:.0f} % worse), {hand.scale:.3f} "
            f"times the rig, from {len(calibration.observations)} frames",
            f"depth disagreement {calibration.after:.3f}, {calibration.before:.3f} at the rig's own scale",
            f"look at {picture}; use it:  depthtrack track RECORDING --hand {out}",
        ]
    )


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
