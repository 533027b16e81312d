"""Compare trackers and options on recordings: a table, CSV, JSON and report.html.

Usage: 05_compare.py FOLDER RECORDING...
"""

import sys
from pathlib import Path

import depthtrack as dt

TRACKERS = {
    "pso": dt.tracker_config("pso"),
    "ik": dt.tracker_config("ik"),
    "ik, 2 iterations": dt.tracker_config("ik", icp_iterations=2),
}


def main(folder: str, *recordings: str, frames: int | None = None, jobs: int | None = None) -> Path:
    """Print the table; return the path of the report."""
    evaluations = dt.compare(recordings, folder, TRACKERS, frames=frames, jobs=jobs)
    print(dt.comparison_table(evaluations))
    return Path(folder) / "report.html"


if __name__ == "__main__":
    print(main(*sys.argv[1:]))
