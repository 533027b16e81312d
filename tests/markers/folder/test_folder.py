"""A marker folder is read back, has the same bytes twice, and rejects damage."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.markers.folder.contents import Source
from depthtrack.markers.folder.reading import MarkerFolder
from depthtrack.markers.folder.writing import check_output, write_marker_folder
from depthtrack.markers.labelled_capture import LabelledCapture
from depthtrack.recording.run_folder import Run
from tests.support.markers import labelled_hands


@pytest.fixture(scope="module")
def labelled() -> LabelledCapture:
    return labelled_hands(sides=("right", "left"))


def same(a: np.ndarray, b: np.ndarray, atol: float = 0) -> None:
    np.testing.assert_allclose(a, b, rtol=0, atol=atol, equal_nan=True)


def files(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def test_a_folder_is_read_back(labelled: LabelledCapture, tmp_path: Path) -> None:
    write_marker_folder(tmp_path / "out", labelled, configuration={"method": "stand-in"})
    found = MarkerFolder.load(tmp_path / "out")
    assert found.contents.configuration == {"method": "stand-in"}
    assert [model.labels for model in found.labelled.models] == [model.labels for model in labelled.models]
    for k in range(3):
        same(found.labelled.positions(k), labelled.positions(k), 1e-12)
        same(found.labelled.poses[k], labelled.poses[k])
        same(found.labelled.confidence[k], labelled.confidence[k])
        same(found.labelled.residuals(k), labelled.residuals(k), 1e-9)
    before, after = labelled.rest(), found.labelled.rest()
    same(np.nansum(after.positions, axis=1), np.nansum(before.positions, axis=1), 1e-12)
    assert all(label.startswith("*") for label in after.labels)


def test_a_second_folder_has_the_same_bytes(labelled: LabelledCapture, tmp_path: Path) -> None:
    capture = tmp_path / "capture.csv"
    capture.write_text("T1-X,T1-Y,T1-Z\n1,2,3\n")
    for name in "ab":
        write_marker_folder(tmp_path / name, labelled, Source.of(capture))
    assert files(tmp_path / "a") == files(tmp_path / "b")
    with pytest.raises(InputError, match="already holds labelled markers"):
        write_marker_folder(tmp_path / "a", labelled)


def test_a_changed_source_is_found(labelled: LabelledCapture, tmp_path: Path) -> None:
    capture = tmp_path / "capture.csv"
    capture.write_text("T1-X,T1-Y,T1-Z\n1,2,3\n")
    write_marker_folder(tmp_path / "out", labelled, Source.of(capture))
    found = MarkerFolder.load(tmp_path / "out")
    found.check_source()
    capture.write_text("T1-X,T1-Y,T1-Z\n1,2,4\n")
    with pytest.raises(InputError, match="has changed since"):
        found.check_source()
    capture.unlink()
    found.check_source()
    with pytest.raises(InputError, match="cannot read"):
        Source.of(capture)


def test_rows_state_status_residual_and_visible_fingers(labelled: LabelledCapture, tmp_path: Path) -> None:
    write_marker_folder(tmp_path / "out", labelled)
    run = Run.load(tmp_path / "out" / "right")
    words = [str(status) for status in run.status]
    assert words[:2] == ["started", "tracked"]
    assert words[20:25] == ["absent", "lost", "absent", "absent", "started"]
    rms = 1000 * np.sqrt(np.nanmean(labelled.residuals(0)[:5] ** 2, axis=1))
    same(run.energy[:5], rms, 1e-9)
    thumb = (labelled.models[0].bodies - 1) // 3 == 0
    same(run.visibility[:, 0], (labelled.columns[0][:, thumb] >= 0).mean(axis=1))
    assert json.loads((tmp_path / "out" / "right" / "run.json").read_text())["sequence"] == "recording"


def test_names_of_other_trajectories_are_kept(labelled: LabelledCapture) -> None:
    first = labelled.models[0].labels[0]
    capture = replace(labelled.capture, labels=("Head", f"right:{first}", *labelled.capture.labels[2:]))
    names = replace(labelled, capture=capture).rest().labels
    assert len(set(names)) == len(names)
    assert f"right:{first}" not in names
    free = replace(labelled, capture=capture, columns=tuple(np.full_like(each, -1) for each in labelled.columns))
    assert free.rest().labels[0] == "Head"


@pytest.mark.parametrize("name", ["", "../right", "a/b", ".hidden", "models", "x" * 65, "right\n", "labelled"])
def test_a_name_that_cannot_be_a_file_is_rejected(name: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="name must be"):
        check_output(tmp_path / "out", (name,))


def test_two_names_that_differ_in_case_are_rejected(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="different names"):
        check_output(tmp_path / "out", ("Right", "right"))


def cut(path: Path) -> None:
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:-1]))


def edit(name: str, old: str, new: str) -> Callable[[Path], object]:
    def change(folder: Path) -> None:
        text = (folder / name).read_text()
        assert old in text
        (folder / name).write_text(text.replace(old, new, 1))

    return change


def rename_a_trajectory(folder: Path) -> None:
    text = (folder / "labelled.csv").read_text()
    (folder / "labelled.csv").write_text(text.replace("box:P1-", "box:P9-"))


FAULTS: dict[str, tuple[Callable[[Path], object], str]] = {
    "no contents": (lambda folder: (folder / "markers.json").unlink(), "is missing"),
    "later format": (edit("markers.json", '"format": 1', '"format": 9'), "expected format 1"),
    "not strict JSON": (edit("markers.json", '"rate": 120.0', '"rate": NaN'), "JSON has no NaN"),
    "a path as a name": (edit("markers.json", '"right"', '"../right"'), "name must be"),
    "a path of trajectories": (edit("markers.json", "labelled.csv", "../labelled.csv"), "labelled must be"),
    "no model": (lambda folder: (folder / "models/box.json").unlink(), "box.json is missing"),
    "another model": (edit("models/box.json", '"name": "box"', '"name": "cup"'), "must hold the model 'box'"),
    "a marker without trajectory": (rename_a_trajectory, "no such trajectory"),
    "short table": (lambda folder: cut(folder / "confidence.csv"), "expected 60 rows"),
    "a word": (edit("box.csv", ",-0.", ",-zero."), "expected numbers"),
    "short run": (lambda folder: cut(folder / "right/poses.csv"), "expected a pose row"),
    "impossible probability": (edit("confidence.csv", ",0.9", ",7.9"), "from 0 to 1"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_damage_is_one_sentence(fault: str, labelled: LabelledCapture, tmp_path: Path) -> None:
    change, message = FAULTS[fault]
    write_marker_folder(tmp_path / "out", labelled)
    change(tmp_path / "out")
    with pytest.raises(InputError, match=message) as error:
        MarkerFolder.load(tmp_path / "out")
    assert "\n" not in str(error.value)
