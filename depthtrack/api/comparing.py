"""Compare trackers on the same recordings."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path

from depthtrack.api.choices import Recording, on_damage_of, path_of
from depthtrack.errors import InputError
from depthtrack.evaluation.compare.comparison import Comparison
from depthtrack.evaluation.compare.comparison import compare as compare_runs
from depthtrack.evaluation.compare.results import as_table, evaluate_runs, tracker_results, write_results
from depthtrack.evaluation.compare.running import Source
from depthtrack.evaluation.compare.specs import TrackerSpec, read_specs
from depthtrack.evaluation.evaluate import Evaluation
from depthtrack.evaluation.sweep.workers import chosen_workers
from depthtrack.machine import usable_cores
from depthtrack.recording.hand_choice import TRUTH
from depthtrack.recording.registry import reading_of
from depthtrack.report.build import write_report
from depthtrack.tracking.configuration import TrackerConfig
from depthtrack.tracking.side_choice import choose_side


def compare(
    recordings: Sequence[Recording],
    out: Path | str,
    trackers: Sequence[str] | Mapping[str, TrackerConfig] = ("hybrid", "pso", "ik"),
    *,
    hand: Path | str | None = None,
    frames: int | None = None,
    repeats: int = 1,
    seed: int = 0,
    equal_ms: float | None = None,
    jobs: int | None = None,
    keypoints: Sequence[Path | str] | None = None,
) -> list[Evaluation]:
    """Compare trackers on recordings, and write results and a report to `out`.

    The runs are in `out`/runs; complete ones are kept if the same comparison is made again.

    trackers: names with options, such as "ik:icp_iterations=3", or configurations by label.
    hand: path of a hand file or rigged mesh, or "truth". If absent, the average adult's hand of the side that fits
        each recording better.
    frames: number of frames to track of each recording; all if absent.
    repeats: runs per tracker and recording, with seeds from `seed` on.
    equal_ms: CPU milliseconds a frame that each tracker may take; its work is chosen to fit.
    jobs: processes, one per core if absent.
    keypoints: a file of 2D keypoints from another detector for each recording (docs/keypoints.md).

    Returns:
        One evaluation per run, recording by recording; `comparison_table` prints them.

    Raises:
        InputError: a recording or tracker cannot be used, or `out` holds another comparison.

    Example:
        evaluations = depthtrack.compare(["my-hand"], "my-comparison", ["hybrid", "ik"])
        print(depthtrack.comparison_table(evaluations))
    """
    folder, workers = Path(out), chosen_workers(jobs)
    if isinstance(trackers, Mapping):
        specs = [TrackerSpec(label, config) for label, config in trackers.items()]
    else:
        specs = read_specs(trackers)
    name = None if hand is None else TRUTH if hand == TRUTH else str(Path(hand).resolve())
    if keypoints is not None and len(keypoints) != len(recordings):
        raise InputError(f"expected keypoints of {len(recordings)} recordings, found {len(keypoints)} files")
    sources = tuple(_source(each, name, frames) for each in recordings)
    if keypoints is not None:
        files = (str(Path(file).resolve()) for file in keypoints)
        sources = tuple(replace(source, keypoints=file) for source, file in zip(sources, files, strict=True))
    runs = compare_runs(Comparison(sources, tuple(specs), repeats, seed, equal_ms), folder, workers)
    evaluations = list(evaluate_runs([Path(run.folder) for run in runs], workers))
    write_results(evaluations, folder)
    write_report(evaluations, folder / "report.html")
    return evaluations


def comparison_table(evaluations: Sequence[Evaluation]) -> str:
    """Return a table for a terminal, one line per tracker and recording.

    Figures are medians over the repeats.
    """
    return as_table(tracker_results(evaluations))


def _source(recording: Recording, hand: str | None, frames: int | None) -> Source:
    """Return the recording as workers open it, with its camera and treatment of damage."""
    if isinstance(recording, Path | str):
        source = Source(str(Path(recording).resolve()), hand=hand, frames=frames)
    else:
        path, camera = str(path_of(recording).resolve()), asdict(recording.camera)
        damage, reading = on_damage_of(recording), reading_of(recording)
        source = Source(path, camera, damage, hand, frames=frames, reading=reading)
    if hand is not None:
        return source
    choice = choose_side(source.open(), source.segmentation, usable_cores(), frames)
    return replace(source, side=choice.side)
