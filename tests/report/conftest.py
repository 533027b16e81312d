"""A recording and runs with known errors."""

from pathlib import Path

import pytest

from depthtrack.evaluation.evaluate import Evaluation, evaluate_run
from tests.support.runs import shifted, synthesise, true_poses, write_run


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return synthesise(tmp_path_factory.mktemp("made") / "everyday", 8)


@pytest.fixture(scope="module")
def runs(recording: Path, tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Write runs Near (two seeds, errors 2 and 4 mm) and Far (9 mm; 20 mm in one lost frame)."""
    folder, poses = tmp_path_factory.mktemp("runs"), true_poses(recording)
    far = shifted(shifted(poses, 9), 11, slice(5, 6))
    return [
        write_run(folder / "far_0", recording, far, {5: "lost"}, label="Far <b>", seed=0),
        write_run(folder / "near_0", recording, shifted(poses, 2), label="Near", seed=0, clock="cpu"),
        write_run(folder / "near_1", recording, shifted(poses, 4), label="Near", seed=1, clock="cpu"),
    ]


@pytest.fixture(scope="module")
def evaluations(runs: list[Path]) -> list[Evaluation]:
    return [evaluate_run(run) for run in runs]
