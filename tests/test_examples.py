"""The examples run and give the stated results."""

import ast
import re
import sys
from importlib.util import module_from_spec, spec_from_file_location
from itertools import pairwise
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

import depthtrack as dt
from depthtrack.calibration.calibrate import Measured
from depthtrack.hand.synergies import load_synergies
from depthtrack.markers.formats.registry import write_capture
from depthtrack.recording.keypoints import HEADER, read_keypoints
from depthtrack.synthesis.marker_capture import MarkerSynthesis, synthesise_markers

FOLDER = Path(__file__).parent.parent / "examples"
FILES = sorted(FOLDER.glob("*.py"))
MOST_LINES = 60
FRAMES = 4


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("examples") / "everyday"
    dt.synthesise("everyday", folder, model="skin", frames=FRAMES)
    return str(folder)


@pytest.fixture(scope="module")
def run(recording: str, tmp_path_factory: pytest.TempPathFactory) -> str:
    return str(dt.track(recording, "truth", "ik", out=tmp_path_factory.mktemp("examples") / "run").folder)


def example(number: int) -> ModuleType:
    (path,) = FOLDER.glob(f"{number:02}_*.py")
    spec = spec_from_file_location(f"example_{path.stem}", path)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_examples_are_numbered_short_listed_and_tested() -> None:
    assert [int(file.stem[:2]) for file in FILES] == list(range(1, len(FILES) + 1))
    assert len(FILES) >= 10
    assert all(len(file.read_text().splitlines()) < MOST_LINES for file in FILES)
    listed = re.findall(r"^\| \[(\w+\.py)\]\(\1\) \| .+ \|$", (FOLDER / "README.md").read_text(), re.MULTILINE)
    assert listed == [file.name for file in FILES]
    tested = set(re.findall(r"example\((\d+)\)", Path(__file__).read_text()))
    assert tested == {str(number) for number in range(1, len(FILES) + 1)}


def test_01_a_replay_prints_each_frame(recording: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert example(1).main(recording, hand="truth") == FRAMES
    lines = capsys.readouterr().out.splitlines()
    assert all(400 < float(line.split()[-2]) < 600 for line in lines)


def test_02_pushed_frames_are_tracked(recording: str) -> None:
    openings = example(2).main(recording, deadline=None)
    assert openings.shape == (FRAMES,)
    assert np.all((openings > 0.01) & (openings < 0.2))


def test_03_a_measured_hand_is_tracked(
    recording: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The measurement takes a minute. Its tests are in tests/calibration."""
    hand, nothing = dt.HandShape(scale=1.05), np.zeros((0, 27))
    calibration = dt.Calibration(hand, {"palm width": Measured(82.0, 1.5, 0.9)}, None, 3.0, 2.0, (), nothing, nothing)
    monkeypatch.setattr("depthtrack.api.measuring.calibrate_either_side", lambda *_: calibration)
    run = example(3).main(recording, str(tmp_path / "hand.json"), str(tmp_path / "run"))
    assert "palm width         82.0 mm" in capsys.readouterr().out
    assert run.configuration["hand"] == hand.to_fields()


def test_04_a_benchmark_measures_each_distance(tmp_path: Path) -> None:
    errors = example(4).main(str(tmp_path), frames=2, distances=(0.5, 0.8))
    assert list(errors) == [0.5, 0.8]
    assert all(error < 20 for error in errors.values())


def test_05_a_comparison_makes_a_report(recording: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    report = example(5).main(str(tmp_path), recording, frames=2, jobs=1)
    assert report.exists()
    assert "ik, 2 iterations" in capsys.readouterr().out


def test_06_energies_grow_with_the_distance_from_the_truth(tmp_path: Path) -> None:
    energies = example(6).main(str(tmp_path), count=60)
    assert energies[0] < 1.05 * energies.min()
    medians = [float(np.median(part)) for part in np.array_split(energies, 3)]
    assert all(near < far for near, far in pairwise(medians))


def test_07_synergies_are_fitted_and_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    synergies = example(7).main(str(tmp_path / "synergies.json"))
    shares = [float(share) for share in re.findall(r"([\d.]+)% of the variance", capsys.readouterr().out)]
    assert shares == sorted(shares)
    assert shares[-1] > 90
    written = load_synergies(tmp_path / "synergies.json")
    np.testing.assert_allclose(written.variances, synergies.variances, rtol=1e-3, atol=1e-9)


def test_08_an_own_stage_follows_the_hand(recording: str) -> None:
    estimates = example(8).main(recording)
    assert [estimate.status for estimate in estimates] == [dt.Status.STARTED] + [dt.Status.TRACKED] * (FRAMES - 1)
    assert "random_steps" in estimates[-1].stage_ms


def test_09_an_own_metric_is_computed(run: str) -> None:
    metric = example(9).main(run)
    assert metric.values.shape == (FRAMES,)
    assert np.all(metric.values < 10)


def test_10_an_own_rig_is_recorded_and_tracked(own_glb: Path, tmp_path: Path) -> None:
    assert example(10).main(str(own_glb), str(tmp_path), frames=2) < 5


def test_11_a_run_is_exported(run: str, tmp_path: Path) -> None:
    track = example(11).main(run, str(tmp_path / "joints.csv"))
    assert len((tmp_path / "joints.csv").read_text().splitlines()) == FRAMES + 1
    assert track.keypoints.shape == (FRAMES, 21, 3)


class StandInDetector:
    """Finds two hands in each image but the first, at a corner and at the centre."""

    def __init__(self) -> None:
        self.times: list[int] = []

    def __enter__(self) -> "StandInDetector":
        return self

    def __exit__(self, *_: object) -> None:
        return None

    def detect_for_video(self, image: Any, milliseconds: int) -> SimpleNamespace:
        self.times.append(milliseconds)
        if len(self.times) == 1:
            return SimpleNamespace(hand_landmarks=[], handedness=[])
        hands = [[SimpleNamespace(x=place, y=place)] * 21 for place in (0.0, 0.5)]
        sides = [[SimpleNamespace(score=score)] for score in (0.6, 0.9)]
        return SimpleNamespace(hand_landmarks=hands, handedness=sides)


def test_12_keypoints_of_mediapipe_are_read(recording: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """MediaPipe, whose libraries conflict with ours, is replaced by a stand-in."""
    detector, out = StandInDetector(), tmp_path / "keypoints.csv"
    vision = SimpleNamespace(
        HandLandmarkerOptions=lambda **options: options,
        RunningMode=SimpleNamespace(VIDEO="video"),
        HandLandmarker=SimpleNamespace(create_from_options=lambda options: detector),
    )
    tasks = SimpleNamespace(vision=vision, BaseOptions=lambda model_asset_path: model_asset_path)
    image = SimpleNamespace(create_from_file=lambda path: SimpleNamespace(width=640, height=480))
    monkeypatch.setitem(sys.modules, "mediapipe", SimpleNamespace(tasks=tasks, Image=image))
    assert example(12).main(recording, "hand_landmarker.task", str(out)) == FRAMES - 1
    found = read_keypoints(out)
    assert found.rows(dt.open_recording(recording).timestamps).tolist() == list(range(FRAMES))
    np.testing.assert_allclose(found.pixels[1, 20], (319.5, 239.5))
    assert (found.confidence[0].max(), found.confidence[1, 0], found.side) == (0, 0.9, None)
    assert tuple(example(12).HEADER) == HEADER


def test_13_markers_become_joint_angles(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The search for the markers takes minutes, so the capture has its labels."""
    pytest.importorskip("ezc3d", reason="ezc3d is not installed: pip install 'depthtrack[markers]'")
    made = synthesise_markers(MarkerSynthesis(frames=40, rate=60.0, seed=3))
    write_capture(tmp_path / "trial.c3d", made.truth.labelled())
    angles = example(13).main(str(tmp_path / "trial.c3d"), "26", str(tmp_path / "solved"))
    text = capsys.readouterr().out
    assert "hand_length" in text
    assert re.search(r"\d+ gaps filled, \d+ left", text)
    lines = angles.read_text().splitlines()
    assert len(lines[lines.index("endheader") + 2 :]) == 40
    assert dt.read_marker_folder(f"{tmp_path / 'solved'}-filled").filled is not None


def test_12_needs_nothing_of_depthtrack_and_states_what_is_missing(
    recording: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tree = ast.parse((FOLDER / "12_mediapipe_keypoints.py").read_text())
    imports = {ast.unparse(node) for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom)}
    assert not any("depthtrack" in each for each in imports)
    monkeypatch.setitem(sys.modules, "mediapipe", None)
    with pytest.raises(SystemExit, match="pip install mediapipe"):
        example(12).main(recording, "hand_landmarker.task", str(tmp_path / "keypoints.csv"))
