"""Write a recording in every format, and compare the poses tracked in each copy.

Usage: compare_formats.py FOLDER [--frames 20] [--only TEXT]

The recording is synthetic, of a skinned hand seen by a Kinect. Each copy is written by the writer of the tests, then
read by the commands info, convert and track. Depth alone is tracked by ik with the true hand. Printed is a table: the
format, who wrote the file, its size, the largest distance of a keypoint from the one in the folder, and what failed.
"""

import argparse
import contextlib
import io
import shutil
import sys
from pathlib import Path

import numpy as np

# The checkout that this script lies in, whatever is installed.
sys.path.insert(0, str(Path(__file__).parents[1]))

import depthtrack
from depthtrack.cli import main as depthtrack_command
from depthtrack.hand.hand_file import load_hand
from depthtrack.hand.kinematics import HandModel
from depthtrack.types import Array
from tests.support.format_copies import FORMATS, FormatCopy, Source


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("--frames", type=int, default=20)
    arguments.add_argument("--only", default="", help="copies whose format contains this text, after the folder")
    chosen = arguments.parse_args()
    recording = chosen.folder / "recording"
    if not recording.exists():
        depthtrack.synthesise(
            "everyday", recording, model="skin", sensor="kinect1", background="room", frames=chosen.frames, seed=3
        )
    source = Source.of(recording)
    expected: Array | None = None
    print("| format | written by | size | difference | |\n| --- | --- | --- | --- | --- |")
    for each in FORMATS:
        if expected is not None and chosen.only not in each.name:
            continue
        size, keypoints, status = tried(each, source, chosen.folder / "copies" / each.name.replace("`", ""))
        expected = keypoints if expected is None else expected
        difference = "-" if keypoints is None or expected is None else difference_text(expected, keypoints)
        print(f"| {each.name} | {each.writer} | {size / 1e6:.1f} MB | {difference} | {status} |", flush=True)


def tried(copy: FormatCopy, source: Source, out: Path) -> tuple[int, Array | None, str]:
    """Return the size of a copy, bytes, its keypoints (T, 21, 3), m, and what failed."""
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    try:
        path = copy.write(source, out)
    except ImportError as error:
        return 0, None, f"not written: {error}"
    root = path if copy.writer == "depthtrack synth" else out
    size = sum(file.stat().st_size for file in root.rglob("*") if file.is_file())
    camera = ["--camera", str(source.folder / "camera.json")] if copy.needs_camera else []
    hand = str(source.folder / "hand.json")
    run = out / "run"
    commands = {
        "info": ["info", str(path), *camera],
        "convert": ["convert", str(path), str(out / "converted"), *camera],
        "track": ["track", str(path), "-o", str(run), "--tracker", "ik", "--hand", hand, "--depth-only", *camera],
    }
    failed = {name: message for name, command in commands.items() if (message := failure(command))}
    status = "; ".join(f"{name}: {message}" for name, message in failed.items()) or "info, convert, track"
    if "track" in failed:
        return size, None, status
    poses = depthtrack.read_run(run).poses
    return size, HandModel(load_hand(source.folder / "hand.json")).keypoints(poses), status


def failure(command: list[str]) -> str:
    """Return the error of a command, "" if it succeeds."""
    out, errors = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(errors):
        code = depthtrack_command(command)
    return "" if code == 0 else errors.getvalue().strip().splitlines()[-1]


def difference_text(expected: Array, found: Array) -> str:
    """Return the largest distance of keypoints (T, 21, 3)."""
    if expected.shape != found.shape:
        return f"{len(found)} of {len(expected)} frames"
    return f"{1000 * np.linalg.norm(found - expected, axis=-1).max():.3g} mm"


if __name__ == "__main__":
    main()
