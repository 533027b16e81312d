"""Record and compare SHA-256 digests of tracked poses, to show that no bit changes.

    python tools/golden_runs.py record golden.json     # before a change
    python tools/golden_runs.py check golden.json      # after it; exit code 1 if a digest differs

Digests depend on the processor and on library versions: compare them on one machine only. The recordings are
synthesised into `--folder`; real ones are added if DEPTHTRACK_DATA names a folder that holds them.
"""

import argparse
import csv
import hashlib
import json
import os
import sys
import time
from pathlib import Path

# The checkout that this script lies in, whatever is installed.
sys.path.insert(0, str(Path(__file__).parents[1]))

from depthtrack.cli import main as depthtrack
from depthtrack.hand.pose import POSE_NAMES

FRAMES = 60
RECORDINGS = {
    "everyday-ideal": ["everyday", "--model", "skin"],
    "everyday-kinect1": ["everyday", "--model", "skin", "--sensor", "kinect1", "--background", "room"],
    "signs": ["signs", "--model", "skin"],
    "fast": ["fast", "--model", "skin"],
}
REAL_RECORDINGS = ("open-close", "kinect2-counting")
TRACKERS = {
    "ik": ["--tracker", "ik"],
    "ik-cylinders": ["--tracker", "ik", "--surface", "cylinders"],
    "ik-leap": ["--tracker", "ik", "--synergies", "leap"],
    "pso": ["--tracker", "pso"],
    "pso-skin": ["--tracker", "pso", "--refine"],
    "ik-paper": ["--tracker", "schroeder2014"],
    "pso-paper": ["--tracker", "oikonomidis2011"],
}


def digest(run: Path) -> str:
    """Return the SHA-256 of frame, time, status and pose in the run's table.

    Energies are left out: they may differ in the last bit.
    """
    with (run / "poses.csv").open(newline="", encoding="utf-8") as file:
        rows = [[*list(row.values())[:3], *(row[name] for name in POSE_NAMES)] for row in csv.DictReader(file)]
    return hashlib.sha256(repr(rows).encode()).hexdigest()


def prepare(folder: Path) -> dict[str, Path]:
    """Synthesise what is missing; return the recordings by name."""
    recordings = {}
    for name, options in RECORDINGS.items():
        recordings[name] = folder / "recordings" / name
        if not recordings[name].exists():
            recordings[name].parent.mkdir(parents=True, exist_ok=True)
            depthtrack(["synth", *options[:1], str(recordings[name]), *options[1:], "--frames", str(FRAMES)])
    data = os.environ.get("DEPTHTRACK_DATA")
    for name in REAL_RECORDINGS if data else ():
        path = Path(str(data)) / "rgbd" / name
        if path.exists():
            recordings[name] = path
    return recordings


def run_all(folder: Path, only: list[str]) -> dict[str, str]:
    """Track each recording with each tracker; return digests by "recording/tracker"."""
    digests = {}
    for name, path in prepare(folder).items():
        for tracker, options in TRACKERS.items():
            key = f"{name}/{tracker}"
            if only and not any(part in key for part in only):
                continue
            run, begun = folder / "runs" / name / tracker, time.perf_counter()
            if run.exists():
                for file in run.iterdir():
                    file.unlink()
                run.rmdir()
            run.parent.mkdir(parents=True, exist_ok=True)
            usual = ["--hand", "average", "--side", "right", "--frames", str(FRAMES)]
            if depthtrack(["track", str(path), "-o", str(run), *usual, *options]) != 0:
                sys.exit(f"{key}: track failed")
            digests[key] = digest(run)
            print(f"{key}: {digests[key][:16]} ({time.perf_counter() - begun:.1f} s)", file=sys.stderr, flush=True)
    return digests


def main() -> int:
    """Parse, run, and compare or store."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("mode", choices=["record", "check"])
    parser.add_argument("file", type=Path, help="JSON file of digests")
    parser.add_argument("--folder", type=Path, default=Path("out/golden"), help="where recordings and runs go")
    parser.add_argument("--only", nargs="*", default=[], help="parts of recording/tracker names")
    arguments = parser.parse_args()
    digests = run_all(arguments.folder, arguments.only)
    if arguments.mode == "record":
        arguments.file.write_text(json.dumps(digests, indent=1) + "\n")
        return 0
    expected = json.loads(arguments.file.read_text())
    differing = [key for key in digests if digests[key] != expected.get(key)]
    print("\n".join(f"differs: {key}" for key in differing) or f"all {len(digests)} digests agree")
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
