"""A run has the same bits with any number of threads, in another process, and after it was resumed."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from depthtrack.cli import main
from tests.support.runs import synthesise

ROOT = Path(__file__).parents[2]
FRAMES = 5
OPTIONS = ("--tracker", "hybrid", "--hand", "truth")
TABLES = ("poses.csv", "branches.csv")


def arguments(recording: Path, run: Path, *options: str) -> list[str]:
    return ["track", str(recording), "-o", str(run), *OPTIONS, *options]


def tables(run: Path) -> dict[str, bytes]:
    return {name: (run / name).read_bytes() for name in TABLES}


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("same") / "recording"
    return synthesise(folder, FRAMES, "--model", "skin", "--sensor", "kinect1", "--forearm", "on")


@pytest.fixture(scope="module")
def expected(recording: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    run = tmp_path_factory.mktemp("same-expected") / "run"
    assert main(arguments(recording, run, "--threads", "1")) == 0
    assert tables(run)["poses.csv"].count(b"\n") == FRAMES + 1
    return tables(run)


@pytest.mark.slow
@pytest.mark.parametrize("threads", [2, 8])
def test_threads_change_no_bit(recording: Path, expected: dict[str, bytes], tmp_path: Path, threads: int) -> None:
    assert main(arguments(recording, tmp_path / "run", "--threads", str(threads))) == 0
    assert tables(tmp_path / "run") == expected


@pytest.mark.slow
@pytest.mark.parametrize("kept", [1, 3])
def test_resuming_changes_no_bit(recording: Path, expected: dict[str, bytes], tmp_path: Path, kept: int) -> None:
    assert main(arguments(recording, tmp_path / "run", "--threads", "2", "--frames", str(FRAMES))) == 0
    path = tmp_path / "run" / "poses.csv"
    path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[: kept + 1]))
    assert main(arguments(recording, tmp_path / "run", "--threads", "1", "--frames", str(FRAMES), "--resume")) == 0
    assert tables(tmp_path / "run") == expected


@pytest.mark.slow
@pytest.mark.parametrize("seed", ["1", "2"])
def test_another_process_and_hash_seed_change_no_bit(
    recording: Path, expected: dict[str, bytes], tmp_path: Path, seed: str
) -> None:
    command = [sys.executable, "-m", "depthtrack", *arguments(recording, tmp_path / "run", "--threads", seed)]
    environment = {**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(ROOT)}
    subprocess.run(command, check=True, env=environment, capture_output=True)
    assert tables(tmp_path / "run") == expected
