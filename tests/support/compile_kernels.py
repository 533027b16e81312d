"""Compile the kernels that most tests need, so that no two workers compile the same one."""

import contextlib
import io
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from depthtrack.cli import main as depthtrack

SCENES = (["--model", "skin", "--sensor", "kinect1", "--background", "room"], ["--model", "primitives"])
TRACKERS = (["ik"], ["ik", "--surface", "cylinders"], ["pso", "--refine"])


def compile_kernels() -> int:
    """Track two recordings of three frames with each tracker; return the highest exit code."""
    codes = []
    with TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        for number, scene in enumerate(SCENES):
            recording = str(Path(folder) / f"recording-{number}")
            codes.append(depthtrack(["synth", "everyday", recording, "--frames", "3", *scene]))
            for tracker, (name, *options) in enumerate(TRACKERS):
                run = str(Path(folder) / f"run-{number}-{tracker}")
                codes.append(
                    depthtrack(["track", recording, "-o", run, "--tracker", name, "--hand", "truth", *options])
                )
    return max(codes)


if __name__ == "__main__":
    sys.exit(compile_kernels())
