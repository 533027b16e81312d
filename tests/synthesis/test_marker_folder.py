"""The folder of a synthetic marker capture."""

from pathlib import Path

import numpy as np
import pytest

from depthtrack.cli import main
from depthtrack.errors import InputError
from depthtrack.markers.folder.reading import MarkerFolder
from depthtrack.markers.formats.registry import read_capture
from depthtrack.markers.models.marker_model import MarkerModel
from depthtrack.synthesis.marker_capture import MarkerSynthesis, SyntheticMarkers, synthesise_markers
from depthtrack.synthesis.marker_folder import write_synthetic_markers

OPTIONS = ("--markers", "13", "--frames", "40", "--rigid-bodies", "1")


@pytest.fixture(scope="module")
def synthetic() -> SyntheticMarkers:
    return synthesise_markers(MarkerSynthesis("grasp", "13", two_hands=True, frames=60, rigid_bodies=1))


@pytest.fixture(scope="module")
def folder(synthetic: SyntheticMarkers, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("synthetic") / "capture"
    write_synthetic_markers(synthetic, path)
    return path


def test_the_capture_reads_back_without_labels(synthetic: SyntheticMarkers, folder: Path) -> None:
    capture = read_capture(folder / "capture.csv")
    assert capture.rate == pytest.approx(200)
    assert not capture.is_labelled.any()
    np.testing.assert_allclose(capture.positions, synthetic.capture.positions, atol=1e-12)


def test_the_truth_is_a_marker_folder(synthetic: SyntheticMarkers, folder: Path) -> None:
    truth = MarkerFolder.load(folder / "truth").labelled
    for k, model in enumerate(synthetic.truth.models):
        assert truth.models[k].name == model.name
        np.testing.assert_allclose(truth.poses[k], synthetic.truth.poses[k], atol=1e-12)
        np.testing.assert_allclose(truth.positions(k), synthetic.truth.positions(k), atol=1e-12)
    complete = read_capture(folder / "truth" / "complete.csv")
    np.testing.assert_allclose(complete.positions, synthetic.complete.positions, atol=1e-12)
    assert np.isfinite(complete.positions).all()


def test_the_models_are_those_of_the_user(synthetic: SyntheticMarkers, folder: Path) -> None:
    for model in synthetic.models:
        stored = MarkerModel.from_json(folder / "models" / f"{model.name}.json")
        np.testing.assert_allclose(stored.offsets, model.offsets, atol=1e-9)


def test_an_existing_folder_is_replaced_only_if_asked(synthetic: SyntheticMarkers, tmp_path: Path) -> None:
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "letter.txt").write_text("mine")
    for overwrite in (False, True):
        with pytest.raises(InputError, match="exists already" if not overwrite else "not overwritten"):
            write_synthetic_markers(synthetic, tmp_path / "own", overwrite=overwrite)
    assert [p.name for p in tmp_path.iterdir()] == ["own"]
    write_synthetic_markers(synthetic, tmp_path / "new")
    with pytest.raises(InputError, match="use --overwrite"):
        write_synthetic_markers(synthetic, tmp_path / "new")
    write_synthetic_markers(synthetic, tmp_path / "new", overwrite=True)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["new", "own"]


def test_the_command_writes_the_same_bytes_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("one", "again"):
        assert main(["synth", "random", str(tmp_path / name), *OPTIONS, "--seed", "3"]) == 0
    assert "40 frames of 'random' at 200 Hz, 17 markers on right, body1" in capsys.readouterr().out
    one, again = (
        {p.relative_to(tmp_path / name): p.read_bytes() for p in (tmp_path / name).rglob("*") if p.is_file()}
        for name in ("one", "again")
    )
    assert one == again


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--ghosts", "3"), "give --markers"),
        (("--markers", "13", "--sensor", "kinect1"), "--sensor is for images"),
        (("--markers", "13", "--held-object", "box"), "--held-object is for images"),
        (("--markers", "13", "--touching"), "only two hands can touch"),
        (("--markers", "no"), "unknown marker layout"),
        (("--markers", "13", "--fps", "0"), "--fps must be from"),
    ],
)
def test_options_that_do_not_fit_are_rejected(
    options: tuple[str, ...], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["synth", "everyday", str(tmp_path / "out"), *options]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
