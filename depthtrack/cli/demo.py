"""`depthtrack demo`: synthesise or open a recording, track it, and write a report."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from depthtrack.cli.argument_checks import OUTPUT_FOLDER
from depthtrack.cli.measuring import calibrate_sequence
from depthtrack.cli.progress import bar
from depthtrack.cli.source_options import SourceOptions
from depthtrack.cli.stated_default import number, stated_default
from depthtrack.errors import InputError
from depthtrack.files import write_atomic

if TYPE_CHECKING:
    from depthtrack.evaluation.compare.running import Source

FRAMES = 240
"""Frames of each synthetic recording: eight seconds."""


@dataclass(frozen=True)
class Command:
    """Track a recording with every tracker and write a report for the browser.

    Without PATH, two recordings of a Kinect in a cluttered room are synthesised first. One shows a smooth skin, the
    surface that ik fits. The other shows spheres and cylinders, the surface that pso fits. Your own recording needs no
    ground truth.
    """

    path: Annotated[Path | None, tyro.conf.Positional, stated_default(metavar="PATH")] = None
    """Your own recording."""
    out: Annotated[Path, OUTPUT_FOLDER, tyro.conf.arg(aliases=("-o",), metavar="DIR")] = Path("depthtrack-demo")
    """Folder to write to. The same folder continues an interrupted demo."""
    recordings: tyro.conf.OmitArgPrefixes[SourceOptions] = field(default_factory=SourceOptions)
    jobs: Annotated[int | None, number(1, 1024, metavar="N")] = None
    """Processes on this machine (default: one per core)."""
    calibrate: bool = True
    """Measure the hand of your recording first if --hand is absent. This takes one to two minutes on two cores."""
    open: bool = False
    """Open the report in the browser."""

    def run(self) -> None:
        from time import perf_counter

        from depthtrack.cli.comparing import compare_and_report
        from depthtrack.evaluation.compare.comparison import Comparison
        from depthtrack.evaluation.compare.specs import read_specs
        from depthtrack.evaluation.sweep.workers import chosen_workers

        begun = perf_counter()
        workers = chosen_workers(self.jobs)
        sources = self._synthesised() if self.path is None else (self._own(self.path),)
        print("tracking with hybrid, pso and ik; the first use compiles kernels, which takes half a minute", flush=True)
        comparison = Comparison(sources, tuple(read_specs(["hybrid,pso,ik"])))
        compare_and_report(comparison, self.out, workers)
        print(f"finished in {perf_counter() - begun:.0f} s; open the report in a browser")
        if self.open:
            import webbrowser

            webbrowser.open((self.out / "report.html").resolve().as_uri())

    def _own(self, path: Path) -> "Source":
        """Return the user's recording with its measured hand, or with the hand of --hand."""
        source, file = self.recordings.source(path), self.out / f"hand-of-{path.resolve().name}.json"
        source = self.recordings.checked(source)
        if source.hand is not None or not self.calibrate:
            return self.recordings.with_side(source)
        if not file.exists() and not _measure_hand(source, file):
            return self.recordings.with_side(source)
        return replace(source, hand=str(file.resolve()))

    def _synthesised(self) -> "tuple[Source, ...]":
        """Return the two synthetic recordings; existing ones are kept."""
        return self._recording("skin-hand", "skin"), self._recording("primitive-hand", "primitives")

    def _recording(self, name: str, model: Literal["skin", "primitives"]) -> "Source":
        from depthtrack.machine import usable_cores
        from depthtrack.recording import open_sequence
        from depthtrack.synthesis.generate import Synthesis, Synthesiser, write_recording

        folder = self.out / "recordings" / name
        frames = self.recordings.frames or FRAMES
        made = Synthesiser(Synthesis(model=model, sensor="kinect1", background="room", frames=frames))
        found = open_sequence(folder).description if folder.exists() else {}
        if not made.description().items() <= found.items():
            print(f"synthesising {frames} frames of a hand of {model}: {folder}", flush=True)
            write_recording(
                made,
                folder,
                overwrite=True,
                threads=usable_cores(),
                progress=lambda each: bar(each, total=frames, heading="synthesising"),
            )
        return self.recordings.source(folder)


def _measure_hand(source: "Source", file: Path) -> bool:
    """Write the sizes of the recording's hand to `file`; return False if the calibration fails."""
    sequence = source.open()
    print(f"measuring the hand: {file}", flush=True)
    try:
        found = calibrate_sequence(sequence, source.segmentation, source.side)
    except InputError as error:
        print(f"the calibration failed, so the average adult's sizes are used: {error}")
        return False
    file.parent.mkdir(parents=True, exist_ok=True)
    write_atomic(file, found.to_json())
    hand = found.hand
    print(f"a {hand.side} hand, {hand.scale:.2f} times the average adult's")
    return True
