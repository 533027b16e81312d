"""A marker folder of a filled capture: how each sample was filled is read back."""

from pathlib import Path

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.markers.filled_capture import FilledCapture, Filling
from depthtrack.markers.folder.reading import MarkerFolder
from depthtrack.markers.folder.writing import write_marker_folder
from tests.support.markers import filled_hands, labelled_hands


@pytest.fixture(scope="module")
def filled() -> FilledCapture:
    return filled_hands(labelled_hands())


def same(a: np.ndarray, b: np.ndarray, atol: float = 0) -> None:
    np.testing.assert_allclose(a, b, rtol=0, atol=atol, equal_nan=True)


def test_a_filled_capture_is_read_back(filled: FilledCapture, tmp_path: Path) -> None:
    write_marker_folder(tmp_path / "out", filled.labelled, filled=filled)
    folder = MarkerFolder.load(tmp_path / "out")
    assert folder.contents.filled
    assert folder.filled is not None
    for k in range(2):
        same(folder.filled.how[k], filled.how[k])
        same(folder.filled.positions[k], filled.positions[k], 1e-12)
        same(folder.filled.expected_error[k], filled.expected_error[k], 1e-12)
        same(folder.filled.poses[k], filled.poses[k])
        measured = filled.how[k] == Filling.MEASURED
        same(folder.labelled.columns[k] >= 0, measured)
        same(folder.labelled.positions(k)[measured], filled.positions[k][measured], 1e-12)
    assert folder.filled.gaps() == filled.gaps()


def test_a_replaced_point_and_no_filled_one_is_among_those_without_a_label(
    filled: FilledCapture, tmp_path: Path
) -> None:
    write_marker_folder(tmp_path / "out", filled.labelled, filled=filled)
    rest = MarkerFolder.load(tmp_path / "out").labelled.rest()
    replaced = sum(int((how == Filling.REPLACED).sum()) for how in filled.how)
    before = np.isfinite(filled.labelled.rest().positions[..., 0]).sum()
    assert np.isfinite(rest.positions[..., 0]).sum() == before + replaced


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (",smoothed,", ",guessed,", "expected frame, label, way, error"),
        (",2.0", ",-2.0", "error of at least 0"),
        (",2.0", ",inf", "error of at least 0"),
        ("\n1,", "\n9999,", "a sample with a position"),
        ("right:", "wrong:", "expected frame, label, way, error"),
    ],
)
def test_damage_is_one_sentence(old: str, new: str, message: str, filled: FilledCapture, tmp_path: Path) -> None:
    write_marker_folder(tmp_path / "out", filled.labelled, filled=filled)
    path = tmp_path / "out" / "filled.csv"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=message):
        MarkerFolder.load(tmp_path / "out")
