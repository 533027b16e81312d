"""Run a comparison with a progress bar, then write its table, files and report."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from depthtrack.cli.progress import bar, counter
from depthtrack.evaluation.compare.comparison import Comparison, ComparisonProgress, Listener, compare
from depthtrack.evaluation.compare.results import as_table, evaluate_runs, run_record, tracker_results, write_results
from depthtrack.evaluation.evaluate import Evaluation
from depthtrack.evaluation.sweep.run import Workers
from depthtrack.outputs import locked
from depthtrack.recording.sequence import Frame
from depthtrack.report.build import check_reportable, write_report
from depthtrack.strict_data import json_text


def compare_and_report(comparison: Comparison, folder: Path, workers: Workers, as_json: bool = False) -> None:
    """Run the comparison, print its table or JSON, and write results and report to `folder`.

    Raises:
        InputError: if a recording is unusable, or `folder` contains runs with other options.
        SweepError: if a run failed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with locked(folder):
        with _bar() as listener:
            plans = compare(comparison, folder, workers, listener)
        folders = [Path(plan.folder) for plan in plans]
        evaluations = list(bar(evaluate_runs(folders, workers), "run", len(folders), "evaluating"))
    if as_json:
        print(json_text([run_record(evaluation) for evaluation in evaluations], indent=2))
    else:
        print(as_table(tracker_results(evaluations)))
    write_everything(evaluations, folder, quiet=as_json)


def write_everything(
    evaluations: Sequence[Evaluation], folder: Path, sequence: Path | None = None, quiet: bool = False
) -> None:
    """Write results.csv, results.json and report.html; print the path of the report.

    sequence: where the recording is now; its recorded path if None.
    quiet: print nothing.

    Raises:
        InputError: if the runs cannot share one report.
    """
    check_reportable(evaluations)
    folder.mkdir(parents=True, exist_ok=True)
    write_results(evaluations, folder)
    write_report(evaluations, folder / "report.html", sequence, _frames)
    if not quiet:
        print(f"\nwrote the report {(folder / 'report.html').resolve()}")


def _frames(frames: Iterable[Frame], heading: str, total: int) -> Iterable[Frame]:
    return bar(frames, "frame", total, heading)


@contextmanager
def _bar() -> Iterator[Listener]:
    """Yield a listener that shows the progress over the frames of all runs."""
    with counter() as shown:

        def listen(progress: ComparisonProgress) -> None:
            shown.set_description(progress.step)
            if progress.total:
                shown.total, shown.n = progress.total, progress.frames
                shown.set_postfix_str("" if progress.frames else "the first use compiles kernels")
            shown.refresh()

        yield listen
