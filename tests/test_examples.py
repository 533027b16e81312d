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
from depthtrack.hand.pose import make_pose
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


class StandInTracker:
    """Takes the place of `HandTracker`, and keeps the frames that an example gives it."""

    def __init__(self, camera: dt.Camera, tracker: str) -> None:
        self.camera, self.frames = camera, list[tuple[Any, Any, float]]()

    def __enter__(self) -> "StandInTracker":
        return self

    def __exit__(self, *_: object) -> None:
        return None

    def update(self, depth: Any, colour: Any, *, timestamp: float) -> dt.Estimate:
        self.frames.append((depth, colour, timestamp))
        return dt.Estimate(make_pose([0, 0, 0], [1, 0, 0, 0], np.zeros(20)), 1.0, 1.0, dt.Status.TRACKED, {}, timestamp)

    def keypoints(self, estimate: dt.Estimate) -> Any:
        return np.arange(63.0).reshape(21, 3)


@pytest.fixture
def trackers(monkeypatch: pytest.MonkeyPatch) -> list[StandInTracker]:
    """The trackers that an example makes."""
    made: list[StandInTracker] = []

    def make(camera: dt.Camera, *, tracker: str) -> StandInTracker:
        made.append(StandInTracker(camera, tracker))
        return made[-1]

    monkeypatch.setattr(dt, "HandTracker", make)
    return made


@pytest.fixture
def frame(recording: str) -> dt.Frame:
    """A frame with colour."""
    return next(frame for frame in dt.open_recording(recording) if frame.colour is not None)


def test_14_a_realsense_camera_is_tracked(
    recording: str,
    trackers: list[StandInTracker],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A recording stands for the camera; tests/live has a file of pyrealsense2."""
    opened = []

    def source(serial: str | None) -> dt.PlayedRecording:
        opened.append(serial)
        return dt.PlayedRecording(dt.open_recording(recording), realtime=False)

    monkeypatch.setattr(dt, "RealSenseSource", source)
    report = example(14).main("123", tracker="ik")
    assert len(report.latencies) == len(trackers[0].frames) > 0
    assert opened == ["123"]
    assert "palm at 0.000 0.000 0.000 m" in capsys.readouterr().out


def test_15_an_azure_kinect_is_tracked(
    frame: dt.Frame, trackers: list[StandInTracker], monkeypatch: pytest.MonkeyPatch
) -> None:
    camera, matrix, stopped = frame.camera, np.eye(3), []
    matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2] = camera.fx, camera.fy, camera.cx, camera.cy + 48
    assert frame.colour is not None
    depth = np.pad(np.rint(1000 * frame.depth).astype(np.uint16), ((48, 48), (0, 0)))
    bgra = np.pad(np.dstack([frame.colour[..., ::-1], frame.colour[..., :1]]), ((48, 48), (0, 0), (0, 0)))
    empty = SimpleNamespace(depth=None, transformed_color=None)
    full = SimpleNamespace(depth=depth, transformed_color=bgra, depth_timestamp_usec=2_000_000)
    waiting = iter([empty, full])
    device = SimpleNamespace(
        start=lambda: None,
        stop=lambda: stopped.append(True),
        get_capture=lambda: next(waiting),
        calibration=SimpleNamespace(
            get_camera_matrix=lambda kind: matrix, get_distortion_coefficients=lambda kind: np.zeros(8)
        ),
    )
    driver = SimpleNamespace(
        PyK4A=lambda config: device,
        Config=lambda **options: options,
        DepthMode=SimpleNamespace(NFOV_UNBINNED=2),
        CalibrationType=SimpleNamespace(DEPTH=0),
    )
    monkeypatch.setitem(sys.modules, "pyk4a", driver)
    report = example(15).main(count=1)
    ((seen, colour, seconds),) = trackers[0].frames
    np.testing.assert_allclose(seen[48:-48], frame.depth, atol=1e-3)
    np.testing.assert_array_equal(colour[48:-48], frame.colour)
    assert (seconds, len(report.latencies), stopped) == (2.0, 1, [True])
    assert (trackers[0].camera.fy, trackers[0].camera.cy) == (camera.fy, camera.cy + 48)


def test_16_an_orbbec_camera_is_tracked(
    frame: dt.Frame, trackers: list[StandInTracker], monkeypatch: pytest.MonkeyPatch
) -> None:
    camera, enabled = frame.camera, list[Any]()
    lens = SimpleNamespace(fx=camera.fx, fy=camera.fy, cx=camera.cx, cy=camera.cy)
    video = SimpleNamespace(
        get_height=lambda: camera.height, get_width=lambda: camera.width, get_intrinsic=lambda: lens
    )
    assert frame.colour is not None
    units, colour = np.rint(frame.depth * 2000).astype(np.uint16), frame.colour  # half a millimetre

    def frameset(number: int) -> SimpleNamespace:
        depth = SimpleNamespace(
            get_data=lambda: units.view(np.uint8).ravel(),
            get_depth_scale=lambda: 0.5,
            get_index=lambda: number,
            get_timestamp_us=lambda: 1_000_000 * number,
            get_stream_profile=lambda: SimpleNamespace(as_video_stream_profile=lambda: video),
        )
        image = SimpleNamespace(get_data=colour.ravel)
        frames = SimpleNamespace(get_depth_frame=lambda: depth, get_color_frame=lambda: image)
        return SimpleNamespace(as_frame_set=lambda: frames)

    waiting = iter([frameset(3), None, frameset(4)])
    pipeline = SimpleNamespace(
        get_stream_profile_list=lambda sensor: SimpleNamespace(get_video_stream_profile=lambda *wanted: wanted),
        start=lambda config: None,
        stop=lambda: enabled.append("stopped"),
        wait_for_frames=lambda milliseconds: next(waiting),
    )
    driver = SimpleNamespace(
        Pipeline=lambda: pipeline,
        Config=lambda: SimpleNamespace(enable_stream=enabled.append),
        AlignFilter=lambda align_to_stream: SimpleNamespace(process=lambda frames: frames),
        OBSensorType=SimpleNamespace(DEPTH_SENSOR=0, COLOR_SENSOR=1),
        OBFormat=SimpleNamespace(Y16="Y16", RGB="RGB"),
        OBStreamType=SimpleNamespace(DEPTH_STREAM="depth"),
    )
    monkeypatch.setitem(sys.modules, "pyorbbecsdk", driver)
    report = example(16).main(count=1)
    ((seen, image, seconds),) = trackers[0].frames
    np.testing.assert_allclose(seen, frame.depth, atol=1e-3)
    np.testing.assert_array_equal(image, colour)
    assert (seconds, len(report.latencies)) == (4.0, 1)
    assert enabled == [(640, 0, "Y16", 30), (640, 0, "RGB", 30), "stopped"]


def test_17_a_ros_node_publishes_keypoints(
    frame: dt.Frame, trackers: list[StandInTracker], monkeypatch: pytest.MonkeyPatch
) -> None:
    camera, callbacks, published = frame.camera, dict[str, Any](), list[Any]()
    header = SimpleNamespace(frame_id="optical")
    lens = [camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1]

    def spin(node: Any) -> None:
        callbacks["/info"](SimpleNamespace(width=camera.width, height=camera.height, k=lens, header=header))
        padded = np.pad(np.rint(1000 * frame.depth).astype("<u2"), ((0, 0), (0, 8)))
        stamp = SimpleNamespace(sec=5, nanosec=250_000_000)
        size = {"height": camera.height, "width": camera.width, "is_bigendian": 0, "encoding": "16UC1"}
        callbacks["/depth"](SimpleNamespace(header=SimpleNamespace(stamp=stamp), data=padded.tobytes(), **size))

    def publish(message: Any) -> None:
        published.append(message)
        raise KeyboardInterrupt

    node = SimpleNamespace(
        create_publisher=lambda *_: SimpleNamespace(publish=publish),
        create_subscription=lambda kind, topic, callback, qos: callbacks.update({topic: callback}),
    )
    modules: dict[str, Any] = {
        "rclpy": SimpleNamespace(init=lambda: None, create_node=lambda name: node, spin=spin),
        "rclpy.qos": SimpleNamespace(qos_profile_sensor_data=None),
        "sensor_msgs.msg": SimpleNamespace(CameraInfo=None, Image=None),
        "geometry_msgs.msg": SimpleNamespace(
            Point=lambda **place: SimpleNamespace(**place),
            Pose=lambda position: SimpleNamespace(position=position),
            PoseArray=lambda poses: SimpleNamespace(poses=poses, header=SimpleNamespace(frame_id="")),
        ),
    }
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    with pytest.raises(KeyboardInterrupt):
        example(17).main("/depth", "/info")
    ((seen, colour, seconds),) = trackers[0].frames
    np.testing.assert_allclose(seen, frame.depth, atol=1e-3)
    assert (colour, seconds, trackers[0].camera.cx) == (None, 5.25, camera.cx)
    (found,) = published
    assert (found.header.frame_id, len(found.poses), found.poses[20].position.z) == ("optical", 21, 62.0)


def test_17_depth_of_ros_images_is_in_metres() -> None:
    floats = np.array([[1.5, np.nan], [np.inf, 0.0]], ">f4")
    image = SimpleNamespace(encoding="32FC1", is_bigendian=1, data=floats.tobytes(), height=2, width=2)
    np.testing.assert_array_equal(example(17).depth_of(image), [[1.5, 0], [0, 0]])


@pytest.mark.parametrize(
    ("number", "module", "advice"),
    [(15, "pyk4a", "pip install pyk4a"), (16, "pyorbbecsdk", "pip install pyorbbecsdk2"), (17, "rclpy", "ROS 2")],
)
def test_a_missing_driver_is_named(number: int, module: str, advice: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(SystemExit, match=advice):
        example(number).main()
