"""`depthtrack segment`: the hand in every frame, to look at and in figures."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from depthtrack.cli.hand_options import HandOptions
from depthtrack.cli.progress import bar
from depthtrack.cli.recording_options import RecordingOptions
from depthtrack.errors import InputError
from depthtrack.files import replace_atomically
from depthtrack.tracking.configuration import TrackerName

if TYPE_CHECKING:
    from collections.abc import Iterator
    from contextlib import AbstractContextManager

    from depthtrack.evaluation.segmentation import SegmentedFrame
    from depthtrack.recording import Sequence
    from depthtrack.tracking.tracker import Tracker


@dataclass(frozen=True)
class Command:
    """Find the hand in every frame, by skin colour and depth, its bare forearm cut off at the wrist.

    Writes an overlay video, a contact sheet and a table, and tells how well the result agrees with the recording's
    true silhouettes where it knows them.
    """

    recording: tyro.conf.OmitArgPrefixes[RecordingOptions]
    out: Annotated[Path | None, tyro.conf.arg(aliases=("-o",), metavar="FOLDER")] = None
    """Folder to write to; NAME-segmented here unless given."""
    skin_model: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """Skin colours learnt by `depthtrack train-skin`; published statistics unless given."""
    depth_only: bool = False
    """Leave colour aside."""
    wrist_margin: Annotated[float, tyro.conf.arg(metavar="MM")] = 0.0
    """Keep so much of the forearm beyond the wrist, to compare with silhouettes that do."""
    tracker: TrackerName | None = None
    """Let a tracker tell where hand and wrist are, as it does in `depthtrack track`: slower, and surer of the wrist."""
    hands: tyro.conf.OmitArgPrefixes[HandOptions] = field(default_factory=HandOptions)
    json: bool = False
    """Print JSON instead of text."""

    def run(self) -> None:
        from json import dumps

        from depthtrack.cli.output_folder import check_output_folder
        from depthtrack.evaluation.segmentation import segment_sequence, summary
        from depthtrack.segmentation.options import SegmentationOptions
        from depthtrack.segmentation.segmenter import Segmenter

        if self.hands != HandOptions() and self.tracker is None:
            raise InputError("--hand and --side are for a tracker: give one with --tracker ik or --tracker pso")
        if not -50 <= self.wrist_margin <= 200:
            raise InputError(f"--wrist-margin must be from -50 to 200 mm, found {self.wrist_margin:g}")
        sequence = self.recording.open()
        skin_model = None if self.skin_model is None else str(self.skin_model)
        options = SegmentationOptions(not self.depth_only, skin_model, self.wrist_margin / 1000)
        segmenter = Segmenter.for_sequence(sequence, options)
        folder = self.out or Path(f"{sequence.name}-segmented")
        check_output_folder(folder)
        folder.mkdir(parents=True, exist_ok=True)
        with self._tracker(sequence) as tracker:
            results = segment_sequence(sequence, segmenter, tracker, self.hands.chosen(sequence))
            rows = list(self._written(sequence, results, folder))
        report = {"recording": str(self.recording.path), **summary(rows), "written_to": str(folder)}
        print(dumps(report, indent=2) if self.json else _text(report))

    def _tracker(self, sequence: "Sequence") -> "AbstractContextManager[Tracker | None]":
        from contextlib import closing, nullcontext

        from depthtrack.tracking.registry import create_tracker, tracker_config

        if self.tracker is None:
            return nullcontext()
        return closing(create_tracker(tracker_config(self.tracker), self.hands.chosen(sequence)))

    def _written(
        self, sequence: "Sequence", results: "Iterator[SegmentedFrame]", folder: Path
    ) -> "Iterator[dict[str, Any]]":
        """Pass on the figures of each frame, while video, contact sheet and table are made of the whole."""
        import csv

        from depthtrack.viewing.annotated_frame import AnnotatedFrame, evenly_chosen, sequence_depth_range
        from depthtrack.viewing.contact_sheet import contact_sheet, describe, frame_rate, save_picture
        from depthtrack.viewing.panels import panel
        from depthtrack.viewing.video import VideoWriter

        chosen, shown = set(evenly_chosen(len(sequence), 12)), []
        near, far = sequence_depth_range(sequence)
        with (
            replace_atomically(folder / "segments.csv") as table,
            VideoWriter(folder / "overlay.mp4", frame_rate(sequence) or 30.0) as video,
            table.open("w", newline="", encoding="utf-8") as file,
        ):
            rows: csv.DictWriter[str] | None = None
            for result in bar(results, total=len(sequence)):
                moment = AnnotatedFrame(result.frame, result.mask)
                video.write(panel(moment, ("depth", "mask"), 360, near, far))
                if result.frame.index in chosen:
                    shown.append(moment)
                row = result.row()
                if rows is None:
                    rows = csv.DictWriter(file, row)
                    rows.writeheader()
                rows.writerow(row)
                yield row
        save_picture(contact_sheet(shown, sequence.name, describe(sequence), near, far), folder / "contact-sheet.png")


def _text(report: dict[str, Any]) -> str:
    iou = report["mean_iou"]
    ms = report["ms_per_frame"]
    lines = [
        f"{report['recording']}: a hand in {report['frames_with_hand']} of {report['frames']} frames",
        *([] if iou is None else [f"mean overlap with the true silhouette (IoU) {iou:.3f}"]),
        *([] if ms is None else [f"{ms['median']:.1f} ms a frame (95 %: {ms['p95']:.1f} ms)"]),
        f"look at {report['written_to']}/contact-sheet.png and overlay.mp4; figures are in segments.csv",
    ]
    return "\n".join(lines)
