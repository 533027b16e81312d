"""`depthtrack segment`: segment the hand in every frame."""

import dataclasses
from collections.abc import Sequence as Arguments
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from depthtrack.cli.argument_checks import OUTPUT_FOLDER
from depthtrack.cli.hand_options import HandOptions
from depthtrack.cli.progress import bar
from depthtrack.cli.recording_notes import print_notes
from depthtrack.cli.recording_options import RecordingOptions
from depthtrack.cli.segmentation_options import SegmentationArguments, SegmentationShortcuts
from depthtrack.cli.stated_default import stated_default
from depthtrack.errors import InputError
from depthtrack.files import replace_atomically
from depthtrack.outputs import check_folder, locked
from depthtrack.segmentation.options import SegmentationOptions
from depthtrack.tracking.configuration import TrackerName

if TYPE_CHECKING:
    from collections.abc import Iterator
    from contextlib import AbstractContextManager

    from depthtrack.evaluation.segmentation import SegmentedFrame
    from depthtrack.hand.shape import HandShape
    from depthtrack.recording import Sequence
    from depthtrack.tracking.tracker import Tracker


@dataclass(frozen=True)
class SegmentCommand:
    """Segment the hand in every frame by skin colour and depth, without its bare forearm.

    Writes an overlay video, a contact sheet and a table. Prints the IoU with the true silhouettes if the recording has
    them.
    """

    recording: tyro.conf.OmitArgPrefixes[RecordingOptions]
    out: Annotated[Path | None, OUTPUT_FOLDER, stated_default(aliases=("-o",), metavar="FOLDER")] = None
    """Folder to write to (default: NAME-segmented in the current folder)."""
    segmentation_shortcuts: tyro.conf.OmitArgPrefixes[SegmentationShortcuts] = dataclasses.field(
        default_factory=SegmentationShortcuts
    )
    tracker: Annotated[TrackerName | None, stated_default()] = None
    """Tracker whose predictions guide the segmentation, as in `depthtrack track`. This is slower but finds the wrist
    more reliably."""
    hands: tyro.conf.OmitArgPrefixes[HandOptions] = dataclasses.field(default_factory=HandOptions)
    json: bool = False
    """Print JSON instead of text."""

    @property
    def segmentation_options(self) -> SegmentationOptions:
        """Options of the segmentation."""
        raise NotImplementedError

    def run(self) -> None:
        from depthtrack.evaluation.segmentation import segment_sequence, summary
        from depthtrack.recording.depth_checks import no_hand_note
        from depthtrack.segmentation.segmenter import Segmenter
        from depthtrack.strict_data import json_text

        if self.hands != HandOptions() and self.tracker is None:
            raise InputError("--hand and --side need a tracker: give --tracker ik or --tracker pso")
        options = self.segmentation_options
        sequence = self.recording.open(tracked=True)
        segmenter = Segmenter.for_sequence(sequence, options)
        choice = None if self.tracker is None else self.hands.choose_side(sequence, options)
        hand = self.hands.chosen(sequence, choice)
        folder = self.out or Path(f"{sequence.name}-segmented")
        check_folder(folder)
        folder.mkdir(parents=True, exist_ok=True)
        with locked(folder), self._tracker(hand) as tracker:
            results = segment_sequence(sequence, segmenter, tracker, hand)
            rows = list(self._written(sequence, results, folder))
        report = {"recording": str(self.recording.path), **summary(rows), "written_to": str(folder)}
        print(json_text(report, indent=2) if self.json else _text(report))
        if not report["frames_with_hand"]:
            print_notes([no_hand_note(sequence)])

    def _tracker(self, hand: "HandShape") -> "AbstractContextManager[Tracker | None]":
        from contextlib import closing, nullcontext

        from depthtrack.tracking.registry import create_tracker, tracker_config

        if self.tracker is None:
            return nullcontext()
        return closing(create_tracker(tracker_config(self.tracker), hand))

    def _written(
        self, sequence: "Sequence", results: "Iterator[SegmentedFrame]", folder: Path
    ) -> "Iterator[dict[str, Any]]":
        """Yield the row of each frame, and write video, table and contact sheet."""
        import csv

        from depthtrack.viewing.annotated_frame import AnnotatedFrame, evenly_spaced, sequence_depth_range
        from depthtrack.viewing.contact_sheet import contact_sheet, describe, frame_rate, save_picture
        from depthtrack.viewing.panels import panel
        from depthtrack.viewing.video import VideoWriter

        chosen, shown = set(evenly_spaced(len(sequence), 12)), []
        near, far = sequence_depth_range(sequence)
        with (
            replace_atomically(folder / "segments.csv") as table,
            VideoWriter(folder / "overlay.mp4", frame_rate(sequence) or 30.0) as video,
            table.open("w", newline="", encoding="utf-8") as file,
        ):
            rows: csv.DictWriter[str] | None = None
            for result in bar(results, total=len(sequence)):
                annotated = AnnotatedFrame(result.frame, result.mask, occluder=result.occluder)
                video.write(panel(annotated, ("depth", "mask"), 360, near, far))
                if result.frame.index in chosen:
                    shown.append(annotated)
                row = result.row()
                if rows is None:
                    rows = csv.DictWriter(file, row)
                    rows.writeheader()
                rows.writerow(row)
                yield row
        save_picture(contact_sheet(shown, sequence.name, describe(sequence), near, far), folder / "contact-sheet.png")


def command(arguments: Arguments[str]) -> tuple[type[SegmentCommand], SegmentCommand]:
    """Return the command with the options of the segmentation, and its defaults."""
    segmentation = SegmentationArguments(arguments)
    chosen = property(lambda self: segmentation.chosen(self.segmentation, self.segmentation_shortcuts))
    Command = dataclasses.make_dataclass(
        "Command",
        [segmentation.field],
        bases=(SegmentCommand,),
        frozen=True,
        namespace={"__doc__": SegmentCommand.__doc__, "segmentation_options": chosen},
    )
    return Command, Command(recording=RecordingOptions(tyro.MISSING))


def _text(report: dict[str, Any]) -> str:
    iou = report["mean_iou"]
    ms = report["ms_per_frame"]
    lines = [
        f"{report['recording']}: a hand in {report['frames_with_hand']} of {report['frames']} frames",
        *([] if iou is None else [f"mean IoU with the true silhouette: {iou:.3f}"]),
        *([] if ms is None else [f"median {ms['median']:.1f} ms per frame, 95th percentile {ms['p95']:.1f} ms"]),
        f"wrote contact-sheet.png, overlay.mp4 and segments.csv to {report['written_to']}",
    ]
    return "\n".join(lines)
