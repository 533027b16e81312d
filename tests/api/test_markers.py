"""The functions for marker captures, on a capture with labels."""

from pathlib import Path

import numpy as np
import pytest

import depthtrack as dt
from depthtrack.calibration import marker_solution
from depthtrack.markers.formats.registry import write_capture
from depthtrack.markers.initialisation.started import StartedModels
from depthtrack.synthesis.marker_capture import MarkerSynthesis, SyntheticMarkers, synthesise_markers


@pytest.fixture(scope="module")
def made() -> SyntheticMarkers:
    return synthesise_markers(MarkerSynthesis(layout="13", frames=30, rate=60.0, rigid_bodies=1, seed=6))


@pytest.fixture(scope="module")
def capture(made: SyntheticMarkers, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("markers") / "trial.csv"
    write_capture(path, made.truth.labelled())
    return path


def test_a_capture_is_read(capture: Path, made: SyntheticMarkers) -> None:
    found = dt.read_capture(capture, unit="mm")
    assert isinstance(found, dt.MarkerCapture)
    np.testing.assert_allclose(found.positions, made.truth.labelled().positions, rtol=0, atol=1e-9, equal_nan=True)


def test_a_capture_is_solved_and_filled(capture: Path, made: SyntheticMarkers, tmp_path: Path) -> None:
    models: list[str | dt.MarkerModel] = ["13", made.models[1]]
    solution = dt.solve_markers(capture, models, calibrate=False, out=tmp_path / "solved")
    assert solution.sizes() == {}
    folder = dt.read_marker_folder(tmp_path / "solved")
    for k in range(2):
        np.testing.assert_array_equal(folder.labelled.poses[k], solution.labelled.poses[k])
    filled = dt.fill_markers(folder, options=dt.FillOptions(method="spline"), out=tmp_path / "filled")
    assert any(filled.is_filled(gap) for gap in filled.gaps())
    again = dt.read_marker_folder(tmp_path / "filled")
    assert again.filled is not None
    np.testing.assert_array_equal(again.filled.how[0], filled.how[0])
    assert again.contents.source == folder.contents.source


def test_a_changed_source_is_rejected(capture: Path, made: SyntheticMarkers, tmp_path: Path) -> None:
    copy = tmp_path / "copy.csv"
    copy.write_bytes(capture.read_bytes())
    dt.solve_markers(copy, ["13", made.models[1]], calibrate=False, out=tmp_path / "solved")
    copy.write_bytes(capture.read_bytes() + b"\n")
    with pytest.raises(dt.InputError, match="has changed since"):
        dt.fill_markers(tmp_path / "solved")


def test_labelling_writes_a_folder(made: SyntheticMarkers, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(marker_solution, "find_start", lambda *_, **__: StartedModels((None, None)))
    monkeypatch.setattr(marker_solution, "label_from", lambda *_: made.truth)
    labelled = dt.label_markers(made.capture, made.models, out=tmp_path / "out")
    assert labelled is made.truth
    found = dt.read_marker_folder(tmp_path / "out")
    assert found.contents.source is None
    assert found.contents.configuration["command"] == "label"


def test_a_synthetic_capture_is_made_solved_and_evaluated(tmp_path: Path) -> None:
    errors = dt.MeasurementErrors(ghosts=0, dropouts=0.0)
    made = dt.synthesise_markers("grasp", tmp_path / "made", layout="13", frames=12, rate=30.0, errors=errors, seed=4)
    assert len(made.capture) == 12
    again = dt.synthesise_markers(made.options, seed=5)
    assert (again.options.seed, again.options.layout) == (5, "13")
    dt.solve_markers(
        tmp_path / "made" / "truth" / "labelled.csv", made.models, calibrate=False, out=tmp_path / "solved"
    )
    found = dt.evaluate_markers(tmp_path / "solved", truth=tmp_path / "made")
    assert (found.frames, found.labels.f1) == (12, 1.0)
    with pytest.raises(dt.InputError, match="give one of them"):
        dt.evaluate_markers(tmp_path / "solved", truth=tmp_path, labels=tmp_path)
