"""Every write, fsync and rename of the writers fails once in each way; `make robustness` tries the commands."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the campaign forks")
def test_a_failing_disk_leaves_the_old_or_the_new() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "tests.robustness.failing_writes", "--short"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    rows = [line.split() for line in done.stdout.splitlines()[1:]]
    assert [(row[0], row[-1]) for row in rows] == [("recording", "0"), ("run", "0"), ("file", "0")]
    assert all(int(operations) >= 3 and int(kills) == int(operations) for _, operations, _, kills, _ in rows)
