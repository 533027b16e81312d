"""`depthtrack evaluate`: how good a run is, and how fast it was."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from depthtrack.cli.progress import bar

if TYPE_CHECKING:
    from depthtrack.evaluation.evaluate import Evaluation
    from depthtrack.evaluation.metrics import Metric


@dataclass(frozen=True)
class Command:
    """Tell how good runs are: against the truth their recordings know (phalanx endpoints or annotated joints in mm,
    joint angles in degrees), by how they explain what the sensor saw (e3d, e2d, silhouettes), and how fast.
    """

    runs: Annotated[tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="RUN ...")]
    """Run folders written by `depthtrack track`."""
    sequence: Annotated[Path | None, tyro.conf.arg(metavar="PATH")] = None
    """Where the recording is, if it was moved since."""
    residuals: bool = True
    """Look at every frame again, for the metrics that need no truth; without, this is quick."""
    json: bool = False
    """Print JSON instead of a table: an object for one run, a list for several."""

    def run(self) -> None:
        from json import dumps

        from depthtrack.errors import InputError
        from depthtrack.evaluation.evaluate import evaluate_run

        if not self.runs:
            raise InputError("name at least one run folder")
        evaluations = [evaluate_run(folder, self.sequence, self.residuals, bar) for folder in self.runs]
        if self.json:
            reports = [evaluation.to_json() for evaluation in evaluations]
            print(dumps(reports[0] if len(reports) == 1 else reports, indent=2))
        else:
            print("\n\n".join(map(_text, evaluations)))


def _text(evaluation: "Evaluation") -> str:
    losses = evaluation.losses
    lines = [
        f"{evaluation.run.folder}: {evaluation.frames} frames of {evaluation.recording}, "
        f"{evaluation.lost_frames} without a trusted pose"
    ]
    if losses.losses:
        mean = losses.time_to_recovery().statistics()["mean"]
        after = "" if mean is None else f" after {mean:.2f} s on average"
        lines.append(f"  lost {len(losses.losses)} times, found again {losses.recovered} times{after}")
    lines.append(f"  {'':28}{'mean':>9}{'median':>9}{'p95':>9}{'max':>9}")
    lines += [_row(metric.name, metric) for metric in evaluation.metrics]
    lines += [_row(f"  {finger} (mm)", metric) for finger, metric in evaluation.finger_errors.items()]
    lines.append(_row("ms_per_frame", evaluation.ms_per_frame))
    lines += [_row(f"  {stage} (ms)", metric) for stage, metric in evaluation.stage_ms.items()]
    if evaluation.success is None:
        lines.append("  (the recording knows neither true poses nor joints)")
    else:
        shares = ", ".join(f"{100 * evaluation.success.within(mm):.0f} % within {mm} mm" for mm in (10, 20, 30, 40))
        lines.append(f"  largest error of a frame: {shares}; area under the curve {evaluation.success.auc:.3f}")
    return "\n".join(lines)


def _row(name: str, metric: "Metric") -> str:
    cells = ["-" if value is None else f"{value:.2f}" for value in metric.statistics().values()]
    note = "  (p05, min)" if metric.higher_is_better else ""
    return f"  {name:28}" + "".join(f"{cell:>9}" for cell in cells) + note
