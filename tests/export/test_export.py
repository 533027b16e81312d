"""Exported joints are bitwise equal, in the documented order; files are complete or absent."""

import csv
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from depthtrack.cli import main
from depthtrack.errors import InputError
from depthtrack.export.csv_table import HEADER
from depthtrack.export.mot import palm_rotations
from depthtrack.export.uvd import read_uvd, write_uvd
from depthtrack.geometry.rotations import quaternion_exp, rotation_matrix
from depthtrack.hand.benchmark_joints import BENCHMARKS
from depthtrack.hand.kinematics import KEYPOINT_NAMES, HandModel
from depthtrack.hand.pose import POSE_NAMES
from depthtrack.hand.shape import HandShape
from depthtrack.recording import open_sequence
from depthtrack.recording.run_folder import Run
from tests.support.runs import synthesise, true_poses, write_run

DOCUMENTATION = Path(__file__).parents[2] / "docs" / "joints.md"
STATUS = {1: "absent", 3: "lost"}


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return synthesise(tmp_path_factory.mktemp("made") / "everyday", 5)


@pytest.fixture
def run(recording: Path, tmp_path: Path) -> Path:
    return write_run(tmp_path / "run", recording, true_poses(recording), STATUS)


def expected_keypoints(run: Path) -> np.ndarray:
    loaded = Run.load(run)
    return HandModel(HandShape.from_fields(loaded.configuration["hand"])).keypoints(loaded.poses)


# Tables and arrays


def test_a_table_holds_poses_and_keypoints_bitwise(run: Path, tmp_path: Path) -> None:
    assert main(["export", str(run), "-o", str(tmp_path / "out.csv")]) == 0
    with (tmp_path / "out.csv").open(newline="") as file:
        header, *rows = csv.reader(file)
    assert tuple(header) == HEADER
    assert header[11:38] == list(POSE_NAMES)
    assert header[38:41] == ["wrist_x", "wrist_y", "wrist_z"]
    assert header[101:103] == ["wrist_spread", "thumb_cmc_spread"]
    loaded, keypoints = Run.load(run), expected_keypoints(run)
    assert [row[2] for row in rows] == list(loaded.status)
    for k, row in enumerate(rows):
        assert (int(row[0]), float(row[1])) == (loaded.index[k], loaded.timestamps[k])
        if k == 1:
            assert set(row[5:]) == {""}
        else:
            np.testing.assert_array_equal(np.array(row[11:38], dtype=float), loaded.poses[k])
            np.testing.assert_array_equal(np.array(row[38:101], dtype=float).reshape(21, 3), keypoints[k])
            np.testing.assert_array_equal([float(cell or "nan") for cell in row[101:]], loaded.spread[k])


def test_exported_keypoints_are_the_recording_s_own(recording: Path, run: Path, tmp_path: Path) -> None:
    """The keypoints of true poses have the unit, frame and order of joints.csv."""
    assert main(["export", str(run), "-o", str(tmp_path / "out.npz")]) == 0
    truth = open_sequence(recording).ground_truth
    assert truth is not None
    assert truth.joints is not None
    with np.load(tmp_path / "out.npz", allow_pickle=False) as arrays_:
        assert arrays_["keypoint_names"].tolist() == list(KEYPOINT_NAMES)
        assert arrays_["pose_names"].tolist() == list(POSE_NAMES)
        assert arrays_["status"].tolist() == ["started", "absent", "tracked", "lost", "tracked"]
        assert json.loads(str(arrays_["conventions"]))["length"] == "m"
        assert np.isnan(arrays_["keypoints"][1]).all()
        seen = [0, 2, 3, 4]
        np.testing.assert_allclose(arrays_["keypoints"][seen], truth.joints[seen], atol=1e-6)
        np.testing.assert_array_equal(arrays_["poses"][seen], Run.load(run).poses[seen])


# The text of benchmarks


@pytest.mark.parametrize("name", sorted(BENCHMARKS))
def test_benchmark_text_reads_back_with_a_line_for_every_frame(run: Path, tmp_path: Path, name: str) -> None:
    # Frame 2 is absent from the run, like a damaged one, but the text counts lines.
    table = run / "poses.csv"
    lines = table.read_text().splitlines(keepends=True)
    table.write_text("".join(line for line in lines if not line.startswith("2,")))
    assert main(["export", str(run), "-o", str(tmp_path / "out.txt"), "--format", name]) == 0
    benchmark = BENCHMARKS[name]
    joints = read_uvd(tmp_path / "out.txt", benchmark)
    assert joints.shape == (5, len(benchmark.joints), 3)
    assert np.isnan(joints[[1, 2]]).all()
    expected = benchmark.from_keypoints(expected_keypoints(run))
    np.testing.assert_allclose(joints[[0, 3, 4]], expected[[0, 2, 3]], atol=1e-5)


@given(
    points=arrays(np.float64, (3, 14, 3), elements=st.floats(-0.4, 0.4, allow_subnormal=False)),
    unknown=st.integers(0, 13),
)
def test_joints_in_front_of_the_camera_read_back(
    tmp_path_factory: pytest.TempPathFactory, points: np.ndarray, unknown: int
) -> None:
    path, nyu = tmp_path_factory.mktemp("text") / "a.txt", BENCHMARKS["nyu"]
    points = points + np.array([0, 0, 0.8])
    points[1, unknown] = np.nan
    points[2, unknown] = [0.1, 0.1, -0.5]  # behind the camera
    write_uvd(path, nyu, points)
    back = read_uvd(path, nyu)
    points[2, unknown] = np.nan
    np.testing.assert_allclose(back, points, atol=5e-6)


def test_the_text_s_numbers_are_pixels_and_millimetres_down_the_image(tmp_path: Path) -> None:
    path, icvl = tmp_path / "a.txt", BENCHMARKS["icvl"]
    joints = np.tile(np.array([0.1, 0.05, 0.5]), (1, 16, 1))
    write_uvd(path, icvl, joints)
    u, v, d = map(float, path.read_text().split()[:3])
    assert (u, v, d) == pytest.approx((160 + 240.99 * 0.2, 120 + 240.96 * 0.1, 500), abs=1e-3)


@pytest.mark.parametrize("layout", ["{0} {1}", "image_0001.png {0} {1} ", "{0},{1}", "\n{0}\t{1}\n\n"])
def test_commas_blanks_and_file_names_are_accepted(tmp_path: Path, layout: str) -> None:
    first, rest = "160 120 500", " ".join(["nan nan nan", "10 20 0"] + ["161 121 400"] * 13)
    text = layout.format(first, rest)
    (tmp_path / "a.txt").write_text(text.replace(" ", ",") if "," in layout else text)
    joints = read_uvd(tmp_path / "a.txt", BENCHMARKS["icvl"])[0]
    np.testing.assert_allclose(joints[0], [0, 0, 0.5])
    assert np.isnan(joints[1]).all()
    assert np.isnan(joints[2]).all()
    assert joints[3, 2] == 0.4


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "must have a line of u v d"),
        ("1 2 3\n", "line 1: expected 48 numbers"),
        ("1 " * 48 + "\n" + "1 " * 47 + "x\n", "line 2: expected 48 numbers"),
        ("1 " * 47 + "inf\n", "line 1: expected 48 numbers"),
        ("a b " + "1 " * 47 + "\n", "line 1: expected 48 numbers"),
        ("1 " * 47 + "1e30\n", "pixels and millimetres"),
        (b"\xff\xfe\x00", "text file"),
        (None, "missing"),
    ],
)
def test_malformed_text_is_rejected_with_its_line(tmp_path: Path, text: str | bytes | None, expected: str) -> None:
    path = tmp_path / "a.txt"
    if text is not None:
        path.write_bytes(text.encode() if isinstance(text, str) else text)
    with pytest.raises(InputError, match=expected):
        read_uvd(path, BENCHMARKS["icvl"])


def test_a_too_large_file_is_rejected_unread(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    with path.open("wb") as file:
        file.truncate(1 << 40)  # sparse: takes no room
    with pytest.raises(InputError, match="bytes long"):
        read_uvd(path, BENCHMARKS["msra"])


def test_benchmark_joints_have_their_documented_positions() -> None:
    model = HandModel(HandShape())
    pose = np.array([0.1, -0.1, 0.6, *([math.sqrt(0.5)] * 2), 0, 0, *np.full(20, 0.2)])
    keypoints = dict(zip(KEYPOINT_NAMES, model.keypoints(pose), strict=True))
    found = {
        name: dict(zip(benchmark.joints, benchmark.from_keypoints(model.keypoints(pose)), strict=True))
        for name, benchmark in BENCHMARKS.items()
    }
    for name, point in found["msra"].items():
        np.testing.assert_allclose(point, keypoints[name])
    np.testing.assert_allclose(found["nyu"]["thumb_ip"], keypoints["thumb_ip"])
    np.testing.assert_allclose(found["icvl"]["ring_middle"], (keypoints["ring_pip"] + keypoints["ring_dip"]) / 2)
    np.testing.assert_allclose(found["nyu"]["palm"], pose[:3], atol=0.002)
    wrist = (found["nyu"]["wrist_ulnar"] + found["nyu"]["wrist_radial"]) / 2
    assert np.linalg.norm(wrist - found["nyu"]["palm"]) == pytest.approx(0.088, abs=0.002)
    nearer_thumb = np.linalg.norm(found["nyu"]["wrist_radial"] - keypoints["thumb_cmc"])
    assert nearer_thumb < np.linalg.norm(found["nyu"]["wrist_ulnar"] - keypoints["thumb_cmc"])


# OpenSim


def read_mot(path: Path) -> dict[str, np.ndarray]:
    """Return the columns of a motion, read as OpenSim's storage: header lines, names, numbers."""
    lines = path.read_text().splitlines()
    head = dict(line.split("=") for line in lines[1 : lines.index("endheader")])
    names, *rows = [line.split("\t") for line in lines[lines.index("endheader") + 1 :]]
    assert (head["version"], head["inDegrees"]) == ("1", "yes")
    assert (int(head["nRows"]), int(head["nColumns"])) == (len(rows), len(names))
    return dict(zip(names, np.array(rows, dtype=np.float64).T, strict=True))


def test_a_motion_for_opensim_holds_the_poses_in_degrees(run: Path, tmp_path: Path) -> None:
    assert main(["export", str(run), "-o", str(tmp_path / "out.mot")]) == 0
    columns, loaded = read_mot(tmp_path / "out.mot"), Run.load(run)
    posed = np.isfinite(loaded.poses).all(axis=1)
    assert posed.sum() == 4
    np.testing.assert_allclose(columns["time"], loaded.timestamps[posed], rtol=1e-9)
    for k, name in enumerate(POSE_NAMES[7:], start=7):
        np.testing.assert_allclose(np.radians(columns[name]), loaded.poses[posed, k], atol=1e-9)
    np.testing.assert_allclose(columns["palm_tz"], loaded.poses[posed, 2], rtol=1e-9)
    about = [rotation_about(axis, np.radians(columns[f"palm_r{'xyz'[axis]}"])) for axis in range(3)]
    expected = rotation_matrix(loaded.poses[posed, 3:7])
    np.testing.assert_allclose(about[0] @ about[1] @ about[2], expected, atol=1e-8)


def rotation_about(axis: int, angles: np.ndarray) -> np.ndarray:
    vectors = np.zeros((len(angles), 3))
    vectors[:, axis] = angles
    return rotation_matrix(quaternion_exp(vectors))


def test_rotations_of_the_palm_do_not_jump() -> None:
    angle = np.linspace(0, 4 * np.pi, 200)
    poses = np.zeros((200, 27))
    poses[:, 3], poses[:, 6] = np.cos(angle / 2), np.sin(angle / 2)
    np.testing.assert_allclose(palm_rotations(poses)[:, 2], np.degrees(angle), atol=1e-6)


# Smoothing


def test_smoothed_poses_are_exported_with_their_delay(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, options in {"raw": (), "smooth": ("--smooth",), "late": ("--smooth", "--smooth-cutoff", "0.5")}.items():
        assert main(["export", str(run), "-o", str(tmp_path / f"{name}.npz"), *options]) == 0
    printed = capsys.readouterr().out
    assert printed.count("median delay: position") == 2
    tracks = {name: np.load(tmp_path / f"{name}.npz") for name in ("raw", "smooth", "late")}
    distance = {
        name: np.nanmax(np.abs(tracks[name]["keypoints"] - tracks["raw"]["keypoints"])) for name in ("smooth", "late")
    }
    assert 0 < distance["smooth"] < distance["late"] < 0.05
    hand = HandShape.from_fields(Run.load(run).configuration["hand"])
    np.testing.assert_array_equal(tracks["smooth"]["keypoints"], HandModel(hand).keypoints(tracks["smooth"]["poses"]))


# Errors


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["{run}", "-o", "{out}/a.xlsx"], "found 'a.xlsx'"),
        (["{run}", "-o", "{out}/nowhere/a.csv"], "does not exist"),
        (["{run}", "-o", "{out}/a.txt"], "several formats end in .txt: choose one by --format nyu, icvl, msra"),
        (["{run}", "-o", "{out}/a.csv", "--format", "nyu"], "must end in .txt"),
        (["{run}", "-o", "{out}/a.csv", "--format", "xls"], "no format 'xls'"),
        (["{run}", "-o", "{out}/a.json"], "choose one by --format openxr, webxr, mano"),
        (["{run}", "-o", "{out}/a.csv", "--smooth-cutoff", "2"], "--smooth-cutoff needs --smooth"),
        (["{run}", "-o", "{out}/a.csv", "--smooth", "--smooth-cutoff", "0"], "--smooth-cutoff must be from"),
        (["{out}", "-o", "{out}/a.csv"], "holds no run"),
    ],
)
def test_impossible_exports_are_rejected_in_a_sentence(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], expected: str
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    assert main(["export", *(argument.format(run=run, out=out) for argument in arguments)]) == 2
    assert expected in capsys.readouterr().err
    assert list(out.iterdir()) == []


def test_frame_numbers_out_of_range_are_rejected(run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = run / "poses.csv"
    table.write_text(table.read_text().replace("\n4,", "\n4000000000000,"))
    assert main(["export", str(run), "-o", str(tmp_path / "a.txt"), "--format", "nyu"]) == 2
    assert "frames are numbered from 0" in capsys.readouterr().err


# Documentation


def test_the_documentation_has_the_joints_in_their_order() -> None:
    rows = re.findall(r"^\| (\d+) \| `(\w+)` \| (\w+) \|", DOCUMENTATION.read_text(), flags=re.MULTILINE)
    assert [int(number) for number, _, _ in rows] == list(range(21))
    assert [name for _, name, _ in rows] == list(KEYPOINT_NAMES)
    for _, name, theirs in rows:
        # MediaPipe says INDEX_FINGER_MCP and PINKY_MCP.
        assert theirs.lower().replace("_finger", "").replace("pinky", "little") == name


def test_the_documentation_has_the_benchmarks_joints_and_cameras() -> None:
    text = DOCUMENTATION.read_text()
    for name, benchmark in BENCHMARKS.items():
        found = re.search(rf"^\| `{name}` \| ([\d., ]+) \| ([^|]+) \|", text, flags=re.MULTILINE)
        assert found is not None
        camera = benchmark.camera
        assert [float(x) for x in found[1].split(",")] == [camera.fx, camera.fy, camera.cx, camera.cy]
        assert re.findall(r"`(\w+)`", found[2]) == list(benchmark.joints)
    assert all(f"`{name}`" in text for name in POSE_NAMES[:7])
