"""Test the commands with a rigged hand: record, track, evaluate, make a video."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from depthtrack.cli import main
from depthtrack.hand.hand_file import load_hand
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.recording import open_sequence
from tests.support.rigs import write_makehuman_rig

FRAMES = 4


@pytest.fixture(scope="module")
def rig(own_glb: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Path(shutil.copy(own_glb, tmp_path_factory.mktemp("rigged") / "hand.glb"))


@pytest.fixture(scope="module")
def recording(rig: Path) -> Path:
    folder = rig.with_name("recording")
    options = ["--sensor", "kinect1", "--background", "room", "--frames", str(FRAMES)]
    assert main(["synth", "everyday", str(folder), "--model", str(rig), *options]) == 0
    return folder


@pytest.fixture(scope="module")
def run(recording: Path, rig: Path) -> Path:
    folder = rig.with_name("run")
    assert main(["track", str(recording), "-o", str(folder), "--tracker", "ik", "--hand", str(rig)]) == 0
    return folder


def test_the_ground_truth_of_a_recording_is_that_of_the_rig(recording: Path, rig: Path) -> None:
    sequence, hand = open_sequence(recording), load_hand(rig)
    truth = sequence.ground_truth
    assert truth is not None
    assert truth.hand == hand.with_(rig=None)
    assert truth.poses is not None
    assert truth.joints is not None
    np.testing.assert_allclose(HandModel(hand).keypoints(truth.poses), truth.joints, atol=1e-5)
    assert sequence.description["model"] == "rig"
    assert hand.rig is not None
    assert sequence.description["sha256"] == hand.rig.sha256


def test_a_run_stores_the_rig_and_follows_the_hand(run: Path, rig: Path, capsys: pytest.CaptureFixture[str]) -> None:
    stored = json.loads((run / "run.json").read_text())["hand"]
    hand = load_hand(rig)
    assert HandShape.from_fields(stored) == hand
    capsys.readouterr()
    assert main(["evaluate", str(run), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["endpoint_error_mm"]["mean"] < 3


def test_a_video_of_a_run_needs_the_rig_of_the_run(
    run: Path, rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["video", str(run), "-o", str(tmp_path / "film.mp4")]) == 0
    content = rig.read_bytes()
    rig.write_bytes(content.replace(b"depthtrack", b"othertrack"))
    try:
        from depthtrack.hand.skin.mesh import _skin_of

        _skin_of.cache_clear()
        capsys.readouterr()
        assert main(["video", str(run), "-o", str(tmp_path / "second.mp4")]) == 2
        assert "must have the SHA-256" in capsys.readouterr().err
        assert not (tmp_path / "second.mp4").exists()
    finally:
        rig.write_bytes(content)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--model", "robot"], "primitives, skin or a .glb or .gltf file"),
        (["--model", "RIG", "--hand", "hand.json"], "leave --hand out"),
        (["--model", "RIG", "--side", "left"], "must hold a left hand as asked, found a right one"),
        (["--model", "nothing.glb"], "nothing.glb"),
    ],
)
def test_synth_rejects_models_that_are_no_hand(
    rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    arguments = [str(rig) if argument == "RIG" else argument for argument in arguments]
    assert main(["synth", "everyday", str(tmp_path / "out"), *arguments]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("letter", ["R", "L"])
def test_a_rig_of_another_maker_is_recorded_and_tracked(
    real_data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], letter: str
) -> None:
    pytest.importorskip("pygltflib", reason="rigged hands need the extra: pip install 'depthtrack[gltf]'")
    rig = write_makehuman_rig(tmp_path / "hand.glb", real_data, letter)
    recording, run = tmp_path / "recording", tmp_path / "run"
    options = ["--sensor", "kinect1", "--background", "room", "--frames", "8"]
    assert main(["synth", "everyday", str(recording), "--model", str(rig), *options]) == 0
    assert main(["track", str(recording), "-o", str(run), "--tracker", "ik", "--hand", str(rig)]) == 0
    capsys.readouterr()
    assert main(["evaluate", str(run), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["endpoint_error_mm"]["mean"] < 2
    stored = json.loads((run / "run.json").read_text())["hand"]
    assert stored["side"] == {"R": "right", "L": "left"}[letter]
