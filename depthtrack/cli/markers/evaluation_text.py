"""Texts of the evaluation of markers."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from depthtrack.evaluation.marker_evaluation import MarkerEvaluation
    from depthtrack.evaluation.metrics.markers import Mislabelling
    from depthtrack.evaluation.metrics.trajectories import TrajectoryScore

MOST_ERRORS = 20
"""Number of wrong stretches that the text lists; JSON has them all."""


def evaluation_text(evaluation: "MarkerEvaluation") -> str:
    """Return the table that `depthtrack evaluate` prints."""
    return "\n".join(_lines(evaluation))


def trajectory_text(name: str, score: "TrajectoryScore") -> str:
    """Return the text on trajectories that were linked without models."""
    fragments = "-" if score.fragments is None else f"{score.fragments:.2f}"
    return (
        f"{name}: {score.trajectories} trajectories of {score.samples} samples, which have {score.stretches} stretches"
        f" without a gap\n  recall {_percent(score.recall)}, purity {_percent(score.purity)},"
        f" {score.switches} switches, {score.mixed} trajectories of several markers, {fragments} trajectories a marker"
    )


def _lines(evaluation: "MarkerEvaluation") -> Iterator[str]:
    score = evaluation.labels
    yield f"{evaluation.folder}: {evaluation.frames} frames, compared with {evaluation.truth}"
    yield (
        f"  labels: accuracy {_percent(score.accuracy)}, precision {_percent(score.precision)},"
        f" recall {_percent(score.recall)}, F1 {_percent(score.f1)}"
    )
    yield (
        f"  samples: {score.right.sum()} right, {score.swapped.sum()} swapped, {score.false.sum()} of no marker,"
        f" {score.missed.sum()} missed; {score.rejected} other points without a label"
    )
    for error in score.errors[:MOST_ERRORS]:
        yield f"    {_error(error)}"
    if len(score.errors) > MOST_ERRORS:
        yield f"    and {len(score.errors) - MOST_ERRORS} other stretches: --json lists them all"
    positions = evaluation.positions
    yield f"  {'positions (mm)':20}{'samples':>9}{'mean':>9}{'median':>9}{'p95':>9}{'max':>9}"
    report = positions.to_json()
    for name, values in (("measured", report["measured"]), *report["by_way"].items()):
        yield _row(name, values)
    for name, angles in evaluation.angles.items():
        found = angles.to_json()
        yield (
            f"  angles of {name}: {_degrees(found['angle_error_deg']['mean'])} mean over {found['frames']} frames,"
            f" {_degrees(found['seen_angle_error_deg'])} without and"
            f" {_degrees(found['dropped_angle_error_deg'])} with dropped markers on the finger"
        )


def _error(error: "Mislabelling") -> str:
    what = "no marker" if error.true is None else error.true
    first, last = error.first + 1, error.last + 1  # people count from 1, as --frames does
    frames = f"frame {first}" if first == last else f"frames {first} to {last}"
    return f"{frames}: a point of {what} has the label {error.given}"


def _row(name: str, values: Mapping[str, float | int | None]) -> str:
    cells = ["-" if value is None else f"{value:.2f}" for key, value in values.items() if key != "samples"]
    return f"    {name:18}{values['samples']:>9}" + "".join(f"{cell:>9}" for cell in cells)


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100 * share:.3f} %"


def _degrees(value: float | None) -> str:
    return "-" if value is None else f"{value:.4f} degrees"
