"""Make recordings with exact ground truth at several distances, and see how both trackers do: a benchmark of one's own.

synthetic_benchmark.py FOLDER writes the recordings, the runs, and report.html.
"""

import sys
from pathlib import Path

from depthtrack.evaluation.compare.comparison import Comparison, compare
from depthtrack.evaluation.compare.results import as_table, tracker_results
from depthtrack.evaluation.compare.running import Source
from depthtrack.evaluation.compare.specs import TrackerSpec
from depthtrack.evaluation.evaluate import evaluate_run
from depthtrack.evaluation.sweep.local import LocalWorkers
from depthtrack.report.build import write_report
from depthtrack.synthesis.generate import Synthesis, Synthesiser, write_recording
from depthtrack.tracking.configuration import IkConfig, PsoConfig


def main(folder: str, frames: int = 90, distances: tuple[float, ...] = (0.5, 1.0), jobs: int = 2) -> Path:
    """Compare the trackers; gives the path of the report."""
    sources = []
    for distance in distances:
        path = Path(folder) / "recordings" / f"at-{distance:g}-m"
        made = Synthesiser(Synthesis("grasp", distance=distance, sensor="kinect1", model="skin", frames=frames))
        write_recording(made, path, overwrite=True)
        sources.append(Source(str(path)))
    specs = (TrackerSpec("PSO", PsoConfig()), TrackerSpec("IK", IkConfig()))
    runs = compare(Comparison(tuple(sources), specs), Path(folder), LocalWorkers(jobs))
    evaluations = [evaluate_run(Path(run.folder)) for run in runs]
    print(as_table(tracker_results(evaluations)))
    write_report(evaluations, Path(folder) / "report.html")
    return Path(folder) / "report.html"


if __name__ == "__main__":
    print(main(sys.argv[1]))
