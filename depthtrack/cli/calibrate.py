"""`depthtrack calibrate`: measure the sizes of a hand in a recording."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from depthtrack.cli.argument_checks import OUTPUT_FILE, PICTURE
from depthtrack.cli.hand_options import size_notes
from depthtrack.cli.measuring import calibrate_rig_on_sequence, calibrate_sequence
from depthtrack.cli.recording_options import RecordingOptions
from depthtrack.cli.stated_default import number, stated_default
from depthtrack.files import write_atomic
from depthtrack.outputs import check_distinct, check_file
from depthtrack.ranges import MOST_SEED

if TYPE_CHECKING:
    from depthtrack.calibration.calibrate import Calibration
    from depthtrack.calibration.rig_calibration import RigCalibration


_LARGEST_CONFIDENCE = 0.99
"""Largest confidence to print, since rounding would give 1."""


@dataclass(frozen=True)
class Command:
    """Measure the hand of a recording: side, scale, palm, length and width of each finger.

    Record a few seconds of one bare hand that turns, opens and closes in front of the camera. Sizes that the recording
    does not show keep the average. The skin is displaced where no sizes describe it. The file contains a confidence for
    each size. Use the file with `track --hand`.

    With --hand RIG.glb, only the scale of the mesh is measured. The file then refers to the mesh.
    """

    recording: tyro.conf.OmitArgPrefixes[RecordingOptions]
    out: Annotated[Path, OUTPUT_FILE, tyro.conf.arg(aliases=("-o",), metavar="HAND.json")]
    """Hand file to write."""
    side: Literal["auto", "right", "left"] = "auto"
    """Side of the hand; `auto` tries both."""
    hand: Annotated[Path | None, stated_default(metavar="RIG.glb")] = None
    """Rigged mesh (.glb, .gltf), or hand file that refers to one, to scale to the recording."""
    picture: Annotated[Path | None, PICTURE, stated_default(metavar="FILE.png")] = None
    """Picture of the hand before and after calibration to write (default: beside the hand file)."""
    sizes_only: bool = False
    """Measure the sizes alone, without the displacement of the skin from the surface that they give."""
    skin_model: Annotated[Path | None, stated_default(metavar="FILE")] = None
    """Skin colour model from `depthtrack train-skin` (default: published statistics)."""
    seed: Annotated[int, number(0, MOST_SEED)] = 0
    """Seed of the random numbers. The same seed gives the same hand."""
    threads: Annotated[int | None, number(1, 1024, metavar="N")] = None
    """Number of threads (default: one per core). The result does not depend on it."""
    json: bool = False
    """Print JSON instead of text."""

    def run(self) -> None:
        from depthtrack.calibration.calibrate import summary
        from depthtrack.calibration.options import CalibrationOptions
        from depthtrack.hand.hand_file import load_hand
        from depthtrack.segmentation.options import SegmentationOptions
        from depthtrack.strict_data import json_text
        from depthtrack.viewing.calibration_picture import calibration_picture
        from depthtrack.viewing.contact_sheet import save_picture

        picture = self.picture or self.out.with_suffix(".png")
        if self.picture is None:
            check_file(picture, "--picture")
            check_distinct({"-o": self.out, "--picture": picture}, [])
        side = None if self.side == "auto" else self.side
        rig = None if self.hand is None else load_hand(self.hand, side)
        sequence = self.recording.open(tracked=True)
        skin_model = None if self.skin_model is None else str(self.skin_model)
        segmentation = SegmentationOptions(skin_model=skin_model)
        if rig is not None:
            scaled = calibrate_rig_on_sequence(sequence, segmentation, rig, self.seed, self.threads)
            content, page = scaled.to_json(), calibration_picture(scaled, rig)
            report, text = scaled.summary(), _rig_text(scaled, self.out, picture)
        else:
            options = CalibrationOptions(skin_rounds=0) if self.sizes_only else CalibrationOptions()
            measured = calibrate_sequence(sequence, segmentation, side, self.seed, self.threads, options=options)
            content, page = measured.to_json(), calibration_picture(measured)
            report, text = summary(measured), _text(measured, self.out, picture)
        write_atomic(self.out, content)
        save_picture(page, picture)
        report |= {"hand_file": str(self.out), "picture": str(picture)}
        print(json_text(report, indent=2) if self.json else text)


def _rig_text(calibration: "RigCalibration", out: Path, picture: Path) -> str:
    hand = calibration.hand
    return "\n".join(
        [
            f"a {hand.side} hand (the other side fits {100 * calibration.side_margin:.0f} % worse), {hand.scale:.3f} "
            f"times the rig, from {len(calibration.observations)} frames",
            f"depth disagreement {calibration.after:.3f}, {calibration.before:.3f} at the rig's own scale",
            f"check the picture {picture}; use the hand:  depthtrack track RECORDING --hand {out}",
        ]
    )


def _text(calibration: "Calibration", out: Path, picture: Path) -> str:
    hand, margin = calibration.hand, calibration.side_margin
    doubt = "" if calibration.side_sure else ": the side is uncertain; give --side"
    sure = "" if margin is None else f" (the other side fits {100 * margin:.0f} % worse{doubt})"
    before, after, views = calibration.before_mm, calibration.after_mm, len(calibration.observations)
    lines = [
        f"a {hand.side} hand{sure}, {hand.scale:.2f} times the average adult's, from {views} frames",
        f"observed points lie {after:.1f} mm from its skin, {before:.1f} mm from the average hand's",
        f"  {'':16}{'mm':>8}{'± mm':>8}{'confidence':>12}",
        *(
            f"  {name:16}{m.mm:8.1f}{m.sigma_mm:8.1f}{min(m.confidence, _LARGEST_CONFIDENCE):12.2f}"
            for name, m in calibration.measured.items()
        ),
        *size_notes(calibration),
        f"check the picture {picture}; use the hand:  depthtrack track RECORDING --hand {out}",
    ]
    return "\n".join(lines)
