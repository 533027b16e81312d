"""`depthtrack evaluate`: measure errors and time of runs."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from depthtrack.cli.argument_checks import OUTPUT_FOLDER
from depthtrack.cli.progress import bar
from depthtrack.cli.stated_default import stated_default
from depthtrack.errors import InputError

if TYPE_CHECKING:
    from depthtrack.evaluation.evaluate import Evaluation
    from depthtrack.evaluation.metrics import Metric, Reliability, SuccessCurve
    from depthtrack.evaluation.predictions import PredictionEvaluation


@dataclass(frozen=True)
class Command:
    """Evaluate runs: pose errors, E3D, E2D, silhouette IoU and timing; or markers.

    Pose errors need ground truth. Errors of phalanx endpoints or annotated joints are in mm, those of joint angles in
    degrees. Marker folders are compared with true labels, positions and poses. With --predictions, evaluate a
    prediction file of a public benchmark instead.
    """

    runs: Annotated[tuple[Path, ...], tyro.conf.Positional, stated_default(metavar="RUN ...")] = ()
    """Run folders from `depthtrack track`, marker folders from `depthtrack markers`, or capture files with linked
    trajectories."""
    sequence: Annotated[Path | None, stated_default(metavar="PATH")] = None
    """Recording of the runs, if it was moved, or of the predictions."""
    residuals: bool = True
    """Segment every frame again for the metrics without ground truth. This takes most of the time."""
    json: bool = False
    """Print JSON instead of a table: an object for one run, an array for several."""
    report: Annotated[Path | None, OUTPUT_FOLDER, stated_default(metavar="DIR")] = None
    """Also write report.html, results.csv and results.json to this folder."""

    predictions: Annotated[Path | None, stated_default(metavar="FILE.txt")] = None
    """Prediction file of a public benchmark: one line per frame, with u v d of each joint in pixels and millimetres."""
    labels: Annotated[Path | None, stated_default(metavar="FILE")] = None
    """True joints of the same frames in the same format, instead of --sequence; or, for marker folders, a capture file
    with true labels."""
    truth: Annotated[Path | None, stated_default(metavar="FOLDER")] = None
    """Marker folder with true labels and poses, or a synthetic capture (default: the one that was labelled)."""
    benchmark: Annotated[Literal["nyu", "icvl", "msra"] | None, stated_default(metavar="nyu|icvl|msra")] = None
    """Benchmark that defines the joints, their order and the camera of both files."""

    def run(self) -> None:
        from depthtrack.markers.folder.contents import is_marker_folder

        if self.predictions is None and any(is_marker_folder(path) or path.is_file() for path in self.runs):
            self._print(*self._markers())
            return
        evaluations = self._evaluations() if self.predictions is None else []
        reports, texts = [each.to_json() for each in evaluations], list(map(_text, evaluations))
        if self.predictions is not None:
            reports, texts = self._predictions(self.predictions)
        self._print(reports, texts)
        if self.report is not None:
            from depthtrack.cli.comparing import write_everything

            write_everything(evaluations, self.report, self.sequence, quiet=self.json)

    def _print(self, reports: list[dict[str, Any]], texts: list[str]) -> None:
        from depthtrack.strict_data import json_text

        values = reports[0] if len(reports) == 1 else reports
        print(json_text(values, indent=2) if self.json else "\n\n".join(texts))

    def _markers(self) -> tuple[list[dict[str, Any]], list[str]]:
        from depthtrack.cli.markers.evaluation_text import evaluation_text, trajectory_text
        from depthtrack.evaluation.marker_evaluation import evaluate_marker_folder, evaluate_trajectories

        for option in ("report", "sequence", "benchmark"):
            if getattr(self, option) is not None:
                raise InputError(f"--{option} is for runs: evaluate the run of a hand inside the marker folder with it")
        reports, texts = list[dict[str, Any]](), list[str]()
        for path in self.runs:
            if path.is_file():
                if self.labels is None:
                    raise InputError(f"{path} is a file of trajectories: give the true ones as --labels FILE")
                score = evaluate_trajectories(path, self.labels)
                reports.append({"capture": str(path), "truth": str(self.labels), **score.to_json()})
                texts.append(trajectory_text(str(path), score))
            else:
                found = evaluate_marker_folder(path, self.labels, self.truth)
                reports.append(found.to_json())
                texts.append(evaluation_text(found))
        return reports, texts

    def _evaluations(self) -> "list[Evaluation]":
        from depthtrack.evaluation.evaluate import evaluate_run

        if not self.runs:
            raise InputError("name at least one run folder")
        for path in self.runs:
            if not path.exists():
                raise InputError(f"there is no run at {path}: no such folder")
        if self.labels is not None or self.benchmark is not None:
            raise InputError("--labels and --benchmark need --predictions: leave them out to evaluate a run")
        if self.truth is not None:
            raise InputError("--truth is for marker folders: leave it out to evaluate a run")
        return [evaluate_run(folder, self.sequence, self.residuals, bar) for folder in self.runs]

    def _predictions(self, path: Path) -> tuple[list[dict[str, Any]], list[str]]:
        from depthtrack.evaluation.predictions import evaluate_predictions
        from depthtrack.hand.benchmark_joints import find_benchmark
        from depthtrack.recording import open_sequence

        if self.runs or self.report is not None:
            raise InputError("--predictions takes neither run folders nor --report: leave them out")
        if self.benchmark is None:
            raise InputError("--predictions needs the joints and camera of a benchmark: give --benchmark nyu|icvl|msra")
        if (self.labels is None) == (self.sequence is None):
            raise InputError("--predictions needs either --labels FILE.txt or --sequence PATH: give one of them")
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
    if failures := evaluation.run.failures:
        lines.append(f"  {len(failures)} frames failed unexpectedly, first {next(iter(failures.values()))}")
    if losses.losses:
        mean = losses.time_to_recovery().statistics()["mean"]
        after = "" if mean is None else f" after {mean:.2f} s on average"
        lines.append(f"  losses: {len(losses.losses)}, {losses.recovered} of them recovered{after}")
    lines.append(_HEAD)
    lines += [_row(metric.name, metric) for metric in evaluation.metrics]
    lines += [_row(f"  {finger} (mm)", metric) for finger, metric in evaluation.finger_errors.items()]
    lines.append(_row("ms_per_frame", evaluation.ms_per_frame))
    lines += [_row(f"  {stage} (ms)", metric) for stage, metric in evaluation.stage_ms.items()]
    if _compiled(evaluation.ms_per_frame):
        lines.append("  (the first frames compile kernels: use the median)")
    if evaluation.success is None:
        lines.append("  (the recording has neither true poses nor true joints)")
    else:
        lines.append(_success_text(evaluation.success))
    if evaluation.reliability is not None:
        lines.append(_reliability_text(evaluation.reliability))
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
        lines.insert(1, f"  left out: {evaluation.left_out_joints} joints without a position in the other frames")
    return "\n".join(lines if evaluation.success is None else [*lines, _success_text(evaluation.success)])


_HEAD = f"  {'':28}{'mean':>9}{'median':>9}{'p95':>9}{'max':>9}"
_COMPILED_RATIO = 20
"""Ratio of the longest to the median time of a frame above which the longest includes compilation."""


def _compiled(time: "Metric") -> bool:
    """Return whether the longest frame includes compilation, which makes the mean useless."""
    median, longest = (time.statistics()[name] for name in ("median", "max"))
    return median is not None and longest is not None and longest > _COMPILED_RATIO * median


def _success_text(success: "SuccessCurve") -> str:
    shares = ", ".join(f"{100 * success.within(mm):.0f} % within {mm} mm" for mm in (10, 20, 30, 40))
    return f"  largest error of a frame: {shares}; area under the curve {success.auc:.3f}"


def _reliability_text(reliability: "Reliability") -> str:
    text = f"  confidence: {100 * reliability.good:.0f} % of {reliability.frames} frames have no error over 20 mm"
    if reliability.auroc is not None:
        text += f", area under the ROC curve {reliability.auroc:.2f}"
    return text


def _row(name: str, metric: "Metric") -> str:
    cells = ["-" if value is None else f"{value:.2f}" for value in metric.statistics().values()]
    note = "  (p05, min)" if metric.higher_is_better else ""
    return f"  {name:28}" + "".join(f"{cell:>9}" for cell in cells) + note
