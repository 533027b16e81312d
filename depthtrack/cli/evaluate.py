"""`depthtrack evaluate`: how good a run is, and how fast it was."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

if TYPE_CHECKING:
    from depthtrack.evaluation.evaluate import Evaluation


@dataclass(frozen=True)
class Command:
    """Compare runs with the truth their recordings know: phalanx endpoints in mm, joint angles in degrees, time."""

    runs: Annotated[tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="RUN ...")]
    """Run folders written by `depthtrack track`."""
    sequence: Annotated[Path | None, tyro.conf.arg(metavar="PATH")] = None
    """Where the recording is, if it was moved since."""
    json: bool = False
    """Print JSON instead of a table: an object for one run, a list for several."""

    def run(self) -> None:
        from json import dumps

        from depthtrack.errors import InputError
        from depthtrack.evaluation.evaluate import evaluate, recorded_sequence
        from depthtrack.recording import open_sequence
        from depthtrack.recording.run import Run

        if not self.runs:
            raise InputError("name at least one run folder")
        evaluations = []
        for folder in self.runs:
            run = Run.load(folder)
            truth = open_sequence(self.sequence or recorded_sequence(run), on_damage="skip").ground_truth
            evaluations.append(evaluate(run, truth))
        reports = [evaluation.to_json() for evaluation in evaluations]
        if self.json:
            print(dumps(reports[0] if len(reports) == 1 else reports, indent=2))
        else:
            print("\n\n".join(map(_text, evaluations)))


def _text(evaluation: "Evaluation") -> str:
    head = f"{evaluation.run.folder}: {evaluation.frames} frames, {evaluation.lost_frames} without a trusted pose"
    lines = [head, f"  {'':20}{'mean':>9}{'median':>9}{'p95':>9}{'max':>9}"]
    for metric in (*evaluation.metrics, evaluation.ms_per_frame):
        cells = ("-" if value is None else f"{value:.2f}" for value in metric.statistics().values())
        lines.append(f"  {metric.name:20}" + "".join(f"{cell:>9}" for cell in cells))
    if not evaluation.metrics:
        lines.append("  (the recording knows no true poses)")
    return "\n".join(lines)
