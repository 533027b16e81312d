"""Evaluation and comparison from Python."""

from pathlib import Path
from typing import Any

import pytest

import depthtrack as dt
from tests.api.conftest import FRAMES


def test_a_run_is_evaluated_by_folder_or_object(run: dt.Run, path: Path) -> None:
    evaluation = dt.evaluate(run, path)
    assert evaluation.frames == FRAMES
    error = evaluation.metric("endpoint_error_mm")
    assert error is not None
    assert error.values.max() < 10
    quick = dt.evaluate(run.folder, residuals=False)
    assert quick.metric("e3d_mm") is None
    assert evaluation.metric("e3d_mm") is not None


def test_trackers_are_compared_by_name_or_configuration(path: Path, tmp_path: Path) -> None:
    named = dt.compare([path], tmp_path / "named", ["ik:resolution=64,subsample=9"], hand="truth", frames=2, jobs=1)
    config = dt.tracker_config("ik", resolution=64, subsample=9)
    recordings = [dt.open_recording(path)]
    given = dt.compare(recordings, tmp_path / "given", {"mine": config}, hand="truth", frames=2, jobs=1)
    assert named[0].run.poses.tobytes() == given[0].run.poses.tobytes()
    assert "mine" in dt.comparison_table(given)
    for file in ("results.csv", "results.json", "report.html"):
        assert (tmp_path / "named" / file).exists()


def test_a_comparison_needs_a_recording(tmp_path: Path) -> None:
    with pytest.raises(dt.InputError, match="at least one recording"):
        dt.compare([], tmp_path)


def test_a_recording_is_compared_with_the_camera_that_it_was_opened_with(path: Path, tmp_path: Path) -> None:
    camera = dt.open_recording(path).camera
    recording = dt.open_recording(path, dt.Camera(camera.width, camera.height, 500, 500, 320, 240), on_damage="skip")
    config = dt.tracker_config("ik", resolution=64, subsample=9)
    (evaluation,) = dt.compare([recording], tmp_path, {"ik": config}, frames=1, jobs=1)
    assert evaluation.run.configuration["camera"]["fx"] == 500
    assert evaluation.run.configuration["on_damage"] == "skip"


def test_recordings_without_a_path_are_refused(path: Path, tmp_path: Path) -> None:
    class InMemory(list[dt.Frame]):
        """A recording that was never a file."""

        camera = dt.open_recording(path).camera
        name = "in memory"

    recording: Any = InMemory(dt.open_recording(path))
    for use in (lambda: dt.track(recording), lambda: dt.compare([recording], tmp_path)):
        with pytest.raises(dt.InputError, match="HandTracker"):
            use()
