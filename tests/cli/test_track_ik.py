"""Test `depthtrack track --tracker ik`: options, stored configuration, resuming."""

import json
from pathlib import Path

import numpy as np
import pytest

from depthtrack.cli import main
from depthtrack.hand.pose import ANGLES
from depthtrack.hand.synergies import Synergies, load_synergies, save_synergies
from depthtrack.recording.run_folder import Run, read_configuration


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("made") / "everyday"
    assert main(["synth", "everyday", str(folder), "--frames", "4", "--model", "skin"]) == 0
    return str(folder)


def track(recording: str, run: Path, *more: str) -> int:
    return main(["track", recording, "-o", str(run), "--tracker", "ik", "--start", "truth", "--hand", "truth", *more])


def test_a_run_restricted_to_synergies_stays_in_their_space_and_stores_them(recording: str, tmp_path: Path) -> None:
    run = tmp_path / "run"
    options = ("--synergies", "leap-grasps", "--components", "4", "--icp-iterations", "3", "--gn-iterations", "2")
    assert track(recording, run, *options) == 0
    stored = read_configuration(run)["options"]
    assert stored["synergies"] == {"synergies": "leap-grasps", "components": 4, "synergy_prior": False}
    assert (stored["fit"]["icp"]["icp_iterations"], stored["fit"]["icp"]["gn_iterations"]) == (3, 2)
    angles, synergies = Run.load(run).poses[:, ANGLES], load_synergies("leap-grasps").truncated(4)
    np.testing.assert_allclose(synergies.angles(synergies.project(angles)), angles, atol=1e-6)


def test_a_synergy_prior_leaves_all_angles_free(recording: str, tmp_path: Path) -> None:
    run = tmp_path / "run"
    assert (
        track(recording, run, "--synergies", "leap", "--components", "4", "--synergy-prior", "--residual", "plane") == 0
    )
    angles, synergies = Run.load(run).poses[:, ANGLES], load_synergies().truncated(4)
    assert np.abs(synergies.angles(synergies.project(angles)) - angles).max() > 0.05


def test_a_run_resumes_only_with_its_own_synergies(
    recording: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run, file = tmp_path / "run", tmp_path / "mine.json"
    save_synergies(load_synergies("leap-grasps"), file)
    assert track(recording, run, "--synergies", str(file)) == 0
    whole = (run / "poses.csv").read_bytes()
    lines = whole.splitlines(keepends=True)
    (run / "poses.csv").write_bytes(b"".join(lines[:3]))
    assert track(recording, run, "--synergies", str(file), "--resume") == 0
    assert (run / "poses.csv").read_bytes() == whole
    assert track(recording, run, "--synergies", str(file), "--components", "5", "--resume") == 2
    assert "components" in capsys.readouterr().err
    postures = load_synergies().angles(np.random.default_rng(0).normal(size=(30, 20)))
    save_synergies(Synergies.fit(postures), file)
    assert track(recording, run, "--synergies", str(file), "--resume") == 2
    assert "digests.synergies" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--components", "3"), "choose a set with --synergies"),
        (("--synergy-prior",), "choose a set with --synergies"),
        (("--synergies", "magic"), "leap-grasps"),
        (("--synergies", "leap", "--components", "21"), "--components must be from 1 to 20"),
        (("--icp-iterations", "0"), "--icp-iterations must be from 1"),
    ],
)
def test_invalid_options_are_rejected(
    recording: str, tmp_path: Path, arguments: tuple[str, ...], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert track(recording, tmp_path / "run", *arguments) == 2
    printed = capsys.readouterr().err
    assert message in printed
    assert "Traceback" not in printed
    assert not (tmp_path / "run").exists()


def test_run_json_contains_the_options_of_the_tracker_only(recording: str, tmp_path: Path) -> None:
    assert track(recording, tmp_path / "run") == 0
    stored = json.loads((tmp_path / "run" / "run.json").read_text())
    fit = stored["options"]["fit"]
    assert (stored["tracker"], fit["surface"], fit["subsample"]) == ("ik", "skin", 3)
    assert "swarm" not in stored["options"]


def test_options_of_another_tracker_are_rejected(recording: str, tmp_path: Path) -> None:
    with pytest.raises(SystemExit) as ended:
        track(recording, tmp_path / "run", "--particles", "8")
    assert ended.value.code == 2
    assert not (tmp_path / "run").exists()
