"""`depthtrack evaluate`: how good a run is, and how fast it was."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from depthtrack.cli.progress import bar
from depthtrack.errors import InputError

if TYPE_CHECKING:
    from depthtrack.evaluation.evaluate import Evaluation
    from depthtrack.evaluation.metrics import Metric, SuccessCurve
    from depthtrack.evaluation.predictions import PredictionEvaluation


@dataclass(frozen=True)
class Command:
    """Tell how good runs are: against the truth their recordings know (phalanx endpoints or annotated joints in mm,
    joint angles in degrees), by how they explain what the sensor saw (e3d, e2d, silhouettes), and how fast.

    Or, with --predictions, how good somebody's predictions for a public benchmark are.
    """

    runs: Annotated[tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="RUN ...")] = ()
    """Run folders written by `depthtrack track`."""
    sequence: Annotated[Path | None, tyro.conf.arg(metavar="PATH")] = None
    """Where the recording is, if it was moved since; or the recording that --predictions are for."""
    residuals: bool = True
    """Look at every frame again, for the metrics that need no truth; without, this is quick."""
    json: bool = False
    """Print JSON instead of a table: an object for one run, a list for several."""
    report: Annotated[Path | None, tyro.conf.arg(metavar="DIR")] = None
    """Also write report.html, results.csv and results.json to this folder."""

    predictions: Annotated[Path | None, tyro.conf.arg(metavar="FILE.txt")] = None
    """A public prediction file: a line a frame, u v d of each joint, pixels and millimetres."""
    labels: Annotated[Path | None, tyro.conf.arg(metavar="FILE.txt")] = None
    """The true joints of the same frames, in the same format; or give --sequence."""
    benchmark: Annotated[Literal["nyu", "icvl", "msra"] | None, tyro.conf.arg(metavar="nyu|icvl|msra")] = None
    """Whose joints, order and camera both files have."""

    def run(self) -> None:
        from json import dumps

        from depthtrack.cli.output_folder import check_output_folder

        if self.report is not None:
            check_output_folder(self.report, "--report")
        evaluations = self._evaluations() if self.predictions is None else []
        reports, texts = [each.to_json() for each in evaluations], list(map(_text, evaluations))
        if self.predictions is not None:
            reports, texts = self._predictions(self.predictions)
        print(dumps(reports[0] if len(reports) == 1 else reports, indent=2) if self.json else "\n\n".join(texts))
        if self.report is not None:
            from depthtrack.cli.comparing import write_everything

            write_everything(evaluations, self.report, self.sequence, quiet=self.json)

    def _evaluations(self) -> "list[Evaluation]":
        from depthtrack.evaluation.evaluate import evaluate_run

        if not self.runs:
            raise InputError("name at least one run folder")
        if self.labels is not None or self.benchmark is not None:
            raise InputError("--labels and --benchmark belong to --predictions: a run is held against its recording")
        return [evaluate_run(folder, self.sequence, self.residuals, bar) for folder in self.runs]

    def _predictions(self, path: Path) -> tuple[list[dict[str, Any]], list[str]]:
        from depthtrack.evaluation.predictions import evaluate_predictions
        from depthtrack.export.benchmark_joints import find_benchmark
        from depthtrack.recording import open_sequence

        if self.runs or self.report is not None:
            raise InputError("--report and run folders are about tracking: --predictions go without them")
        if self.benchmark is None:
            raise InputError("--predictions need --benchmark nyu, icvl or msra, which tells their joints and camera")
        if (self.labels is None) == (self.sequence is None):
            raise InputError("--predictions are held against --labels FILE.txt or a --sequence PATH: give one of them")
        truth = self.labels if self.sequence is None else open_sequence(self.sequence)
        assert truth is not None
        evaluation = evaluate_predictions(path, find_benchmark(self.benchmark), truth)
        return [evaluation.to_json()], [_prediction_text(evaluation)]


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
    lines.append(_HEAD)
    lines += [_row(metric.name, metric) for metric in evaluation.metrics]
    lines += [_row(f"  {finger} (mm)", metric) for finger, metric in evaluation.finger_errors.items()]
    lines.append(_row("ms_per_frame", evaluation.ms_per_frame))
    lines += [_row(f"  {stage} (ms)", metric) for stage, metric in evaluation.stage_ms.items()]
    if _compiled(evaluation.ms_per_frame):
        lines.append("  (the first frames compile kernels: read the median)")
    if evaluation.success is None:
        lines.append("  (the recording knows neither true poses nor joints)")
    else:
        lines.append(_shares(evaluation.success))
    return "\n".join(lines)


def _prediction_text(evaluation: "PredictionEvaluation") -> str:
    lines = [
        f"{evaluation.predictions}: {evaluation.frames} frames of {evaluation.benchmark.name}, "
        f"{evaluation.missed_frames} without a prediction",
        _HEAD,
        *(_row(metric.name, metric) for metric in (evaluation.points.mean(), evaluation.points.largest())),
        *(_row(f"  {name} (mm)", metric) for name, metric in evaluation.by_joint.items()),
    ]
    if evaluation.left_out_joints:
        lines.insert(1, f"  left out: {evaluation.left_out_joints} joints of other frames that have no position")
    return "\n".join(lines if evaluation.success is None else [*lines, _shares(evaluation.success)])


_HEAD = f"  {'':28}{'mean':>9}{'median':>9}{'p95':>9}{'max':>9}"
_TELLING = 20
"""Times the median frame's milliseconds beyond which one was no ordinary frame."""


def _compiled(time: "Metric") -> bool:
    """Whether a frame took so long that the mean tells little."""
    median, longest = (time.statistics()[name] for name in ("median", "max"))
    return median is not None and longest is not None and longest > _TELLING * median


def _shares(success: "SuccessCurve") -> str:
    shares = ", ".join(f"{100 * success.within(mm):.0f} % within {mm} mm" for mm in (10, 20, 30, 40))
    return f"  largest error of a frame: {shares}; area under the curve {success.auc:.3f}"


def _row(name: str, metric: "Metric") -> str:
    cells = ["-" if value is None else f"{value:.2f}" for value in metric.statistics().values()]
    note = "  (p05, min)" if metric.higher_is_better else ""
    return f"  {name:28}" + "".join(f"{cell:>9}" for cell in cells) + note
