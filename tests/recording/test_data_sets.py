"""Data sets are read by their published formats, and runs are compared with their joints."""

import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
import scipy.io
from numpy.typing import NDArray

from depthtrack.cli import main
from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.evaluation.evaluate import evaluate_run
from depthtrack.geometry.camera import Camera
from depthtrack.hand.benchmark_joints import BENCHMARKS
from depthtrack.hand.kinematics import KEYPOINT_NAMES, HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.recording import Sequence, image_size, open_sequence
from tests.support import data_sets
from tests.support.recordings import CAMERA, colour_at, depth_at, mask_at
from tests.support.runs import shifted, write_run

FRAMES = 3
POSES = np.tile([0.01, -0.02, 0.5, 0, 1.0, 0, 0, *np.linspace(0, 0.4, 20)], (FRAMES, 1))
POSES[:, 0] += 0.001 * np.arange(FRAMES)
KEYPOINTS = HandModel(HandShape()).keypoints(POSES)
Write = Callable[[Path], Path]


def depths(camera: Camera = CAMERA) -> list[NDArray[np.float32]]:
    rows = np.arange(camera.height) * CAMERA.height // camera.height
    columns = np.arange(camera.width) * CAMERA.width // camera.width
    return [depth_at(k)[np.ix_(rows, columns)] for k in range(FRAMES)]


def msra15(root: Path) -> Path:
    msra = BENCHMARKS["msra"]
    return data_sets.write_msra15(root / "P0" / "1", depths(msra.camera), msra.from_keypoints(KEYPOINTS))


def nyu(root: Path) -> Path:
    benchmark = BENCHMARKS["nyu"]
    colour = np.zeros((480, 640, 3), dtype=np.uint8)
    colour[..., 0] = 200
    joints = benchmark.from_keypoints(KEYPOINTS)
    return data_sets.write_nyu(root / "test", depths(benchmark.camera), joints, colour)


def icvl(root: Path) -> Path:
    benchmark = BENCHMARKS["icvl"]
    return data_sets.write_icvl(root, depths(benchmark.camera), benchmark.from_keypoints(KEYPOINTS))


def dexycb(root: Path) -> Path:
    return data_sets.write_dexycb(root, CAMERA, depths(), KEYPOINTS, mask_at(0), colour_at(0))


def ho3d(root: Path) -> Path:
    return data_sets.write_ho3d(root, CAMERA, depths(), KEYPOINTS, colour_at(0))


ALL: tuple[Write, ...] = (msra15, nyu, icvl, dexycb, ho3d)
STEPS: dict[Write, float] = {msra15: 1e-6, ho3d: 0.00013}
"""Rounding of the stored depth, metres, where it is not a millimetre."""


@pytest.mark.parametrize("write", ALL)
def test_depth_times_and_description(write: Write, tmp_path: Path) -> None:
    path = write(tmp_path)
    recording = open_sequence(path)
    assert len(recording) == FRAMES
    assert image_size(path) == (recording.camera.width, recording.camera.height)
    step = 2 if write is ho3d else 1
    np.testing.assert_allclose(recording.timestamps, step * np.arange(FRAMES) / 30)
    for index, depth in enumerate(depths(recording.camera)):
        frame = recording[index]
        assert frame.depth.dtype == np.float32
        np.testing.assert_allclose(frame.depth, depth, atol=STEPS.get(write, 0.00051))
    assert "data set" in recording.description


@pytest.mark.parametrize("write", ALL)
def test_a_run_of_the_true_poses_has_the_error_of_its_shift(write: Write, tmp_path: Path) -> None:
    path = write(tmp_path / "data")
    run = write_run(tmp_path / "run", path, shifted(POSES, 5.0))
    evaluation = evaluate_run(run, residuals=False)
    mean = evaluation.metric("joint_error_mm")
    assert mean is not None
    np.testing.assert_allclose(mean.values, 5, atol=0.01)
    assert set(evaluation.finger_errors) == {"thumb", "index", "middle", "ring", "little"}
    assert all(np.allclose(metric.values, 5, atol=0.01) for metric in evaluation.finger_errors.values())


@pytest.mark.parametrize(
    ("write", "known"),
    [(msra15, KEYPOINT_NAMES), (dexycb, KEYPOINT_NAMES), (ho3d, KEYPOINT_NAMES), (icvl, ())],
)
def test_joints_become_keypoints_by_name(write: Write, known: tuple[str, ...], tmp_path: Path) -> None:
    assert_keypoints(open_sequence(write(tmp_path)), known)


def test_joints_of_nyu_that_are_no_keypoints_are_unknown(tmp_path: Path) -> None:
    fingers = ("index", "middle", "ring", "little")
    known = ("thumb_tip", "thumb_ip", "thumb_mcp", *(f"{f}_{joint}" for f in fingers for joint in ("tip", "pip")))
    assert_keypoints(open_sequence(nyu(tmp_path)), known)


def assert_keypoints(recording: Sequence, known: tuple[str, ...]) -> None:
    truth = recording.ground_truth
    assert truth is not None
    joints = truth.keypoints_at(float(recording.timestamps[1]))
    if not known:
        assert joints is None
        return
    assert joints is not None
    for row, name in enumerate(KEYPOINT_NAMES):
        expected = KEYPOINTS[1, row] if name in known else np.full(3, np.nan)
        np.testing.assert_allclose(joints[row], expected, atol=1e-6, err_msg=name)


@pytest.mark.parametrize("write", [nyu, dexycb, ho3d])
def test_colour_is_registered(write: Write, tmp_path: Path) -> None:
    recording = open_sequence(write(tmp_path))
    assert recording.has_colour
    colour = recording[1].colour
    assert colour is not None
    if write is nyu:
        assert (colour == [200, 0, 0]).all()
    else:
        assert np.abs(colour.astype(int) - colour_at(0)).mean() < 6


def test_predictions_are_compared_with_the_labels_of_the_data_set(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for write, name in ((nyu, "nyu"), (icvl, "icvl"), (msra15, "msra")):
        path = write(tmp_path / name)
        run = write_run(tmp_path / f"run-{name}", path, shifted(POSES, 4.0))
        text = tmp_path / f"{name}.txt"
        assert main(["export", str(run), "-o", str(text), "--format", name]) == 0
        assert main(["evaluate", "--predictions", str(text), "--benchmark", name, "--sequence", str(path)]) == 0
        row = next(line for line in capsys.readouterr().out.splitlines() if line.strip().startswith("joint_error_mm"))
        assert float(row.split()[1]) == pytest.approx(4, abs=0.01)


def test_info_states_the_data_set_and_its_joints(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for write in ALL:
        assert main(["info", str(write(tmp_path / write.__name__))]) == 0
        printed = capsys.readouterr().out
        assert "joints in 3 frames" in printed
        assert "data set" in printed


@pytest.mark.parametrize("write", ALL)
def test_the_folder_of_the_whole_data_set_names_a_recording_in_it(write: Write, tmp_path: Path) -> None:
    path = write(tmp_path / "set")
    with pytest.raises(InputError, match=f"give one of them, such as {path}"):
        open_sequence(tmp_path)


def test_joints_that_are_keypoints_survive_a_conversion(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for write in (nyu, icvl, ho3d):
        path, out = write(tmp_path / write.__name__), tmp_path / f"{write.__name__}-folder"
        assert main(["convert", str(path), str(out)]) == 0
        assert ("are no keypoints" in capsys.readouterr().out) == (write is not ho3d)
        before, after = open_sequence(path).ground_truth, open_sequence(out).ground_truth
        if write is icvl:
            assert after is None
            continue
        assert before is not None
        assert after is not None
        np.testing.assert_array_equal(after.joints, before.joints)


# MSRA15


def test_an_msra_image_is_placed_at_its_bounding_box(tmp_path: Path) -> None:
    depth = np.zeros((240, 320), dtype=np.float32)
    depth[100:130, 40:90] = 0.4
    recording = open_sequence(data_sets.write_msra15(tmp_path / "1", [depth]))
    np.testing.assert_allclose(recording[0].depth, depth)
    assert recording.ground_truth is None


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (b"\0" * 20, "24 bytes of sizes"),
        (struct.pack("<6I", 320, 240, 10, 10, 20, 20) + b"\0" * 399, "must have 424 bytes"),
        (struct.pack("<6I", 320, 240, 20, 10, 10, 20), "inside its image"),
        (struct.pack("<6I", 2**31, 240, 0, 0, 2**31, 240), "inside its image"),
        (struct.pack("<6I", 640, 480, 0, 0, 1, 1) + b"\0" * 4, "camera's 320x240"),
    ],
)
def test_a_damaged_msra_image_is_refused(data: bytes, expected: str, tmp_path: Path) -> None:
    path = msra15(tmp_path)
    (path / "000001_depth.bin").write_bytes(data)
    with pytest.raises(DamagedFrameError, match=expected):
        open_sequence(path)[1]
    assert [frame.index for frame in open_sequence(path, on_damage="skip")] == [0, 2]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "number of lines"),
        ("2\n" + "1 2 -3 " * 21, "number of lines"),
        ("1\n" + "1 2 -3 " * 20, "found 60 fields"),
        ("1\n" + "1 2 3 " * 21, "negative z"),
        ("1\n" + "1 2 x " * 21, "negative z"),
    ],
)
def test_a_malformed_joint_file_is_refused(text: str, expected: str, tmp_path: Path) -> None:
    path = msra15(tmp_path)
    (path / "joint.txt").write_text(text)
    with pytest.raises(InputError, match=expected):
        open_sequence(path)


@pytest.mark.parametrize("counted", [False, True])
def test_labels_whose_depths_are_all_negative_are_refused(
    counted: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = msra15(tmp_path)
    text = (path / "joint.txt").read_text()
    labels, predictions = tmp_path / "labels.txt", tmp_path / "predictions.txt"
    labels.write_text(text if counted else text.split("\n", 1)[1])
    predictions.write_text(("160 120 400 " * 21 + "\n") * 3)
    arguments = ["evaluate", "--predictions", str(predictions), "--benchmark", "msra"]
    assert main([*arguments, "--labels", str(labels)]) == 2
    assert "--sequence" in capsys.readouterr().err
    assert main([*arguments, "--sequence", str(path)]) == 0


# NYU


def test_depth_of_nyu_in_another_image_type_is_refused(tmp_path: Path) -> None:
    path = nyu(tmp_path)
    cv2.imwrite(str(path / "depth_1_0000002.png"), np.zeros((480, 640), dtype=np.uint16))
    with pytest.raises(DamagedFrameError, match="8-bit colours that hold the depth"):
        open_sequence(path)[1]


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({"joint_uvd": np.zeros((3, 2, 36, 3))}, "found nothing"),
        ({"joint_xyz": np.zeros((3, 2, 35, 3))}, "must hold joint_xyz"),
        ({"joint_xyz": np.array([["a"]], dtype=object)}, "must hold joint_xyz"),
    ],
)
def test_another_mat_file_is_refused(values: dict[str, NDArray[np.generic]], expected: str, tmp_path: Path) -> None:
    path = nyu(tmp_path)
    scipy.io.savemat(path / "joint_data.mat", values)
    with pytest.raises(InputError, match=expected):
        open_sequence(path)


@pytest.mark.parametrize("data", [b"", b"\x89HDF\r\n\x1a\n" + b"\0" * 600, b"MATLAB 5.0 MAT-file" + b"\0" * 300])
def test_a_damaged_mat_file_is_one_sentence(data: bytes, tmp_path: Path) -> None:
    path = nyu(tmp_path)
    (path / "joint_data.mat").write_bytes(data)
    with pytest.raises(InputError, match=r"joint_data\.mat must"):
        open_sequence(path)
    whole = nyu(tmp_path / "b") / "joint_data.mat"
    data = whole.read_bytes()
    (path / "joint_data.mat").write_bytes(data[: len(data) // 3])
    with pytest.raises(InputError, match=r"joint_data\.mat"):
        open_sequence(path)


# ICVL


def test_labels_of_icvl_with_too_few_numbers_are_refused(tmp_path: Path) -> None:
    path = icvl(tmp_path)
    labels = tmp_path / "Testing" / "test_seq_1.txt"
    labels.write_text(labels.read_text().replace("test_seq_1/image_0001.png ", "test_seq_1/image_0001.png 7 "))
    with pytest.raises(InputError, match="line 3: expected u v d of 16 joints"):
        open_sequence(path)


# DexYCB


def test_a_frame_of_dexycb_without_a_hand_has_no_joints(tmp_path: Path) -> None:
    joints = KEYPOINTS.copy()
    joints[1] = np.nan
    path = data_sets.write_dexycb(tmp_path, CAMERA, depths(), joints, mask_at(0), colour_at(0))
    recording = open_sequence(path)
    truth = recording.ground_truth
    assert truth is not None
    assert truth.joints is not None
    assert np.isnan(truth.joints[1]).all()
    mask = recording.hand_mask(0)
    assert mask is not None
    np.testing.assert_array_equal(mask, mask_at(0))
    assert recording.camera == replace(CAMERA, depth_scale=0.001)


def test_dexycb_without_its_calibration_needs_a_camera(tmp_path: Path) -> None:
    path = dexycb(tmp_path)
    calibration = next((tmp_path / "calibration" / "intrinsics").iterdir())
    calibration.write_text(calibration.read_text().replace("ppx", "cx"))
    with pytest.raises(InputError, match="must hold fx, fy, ppx and ppy"):
        open_sequence(path)
    calibration.unlink()
    with pytest.raises(InputError, match="give the camera"):
        open_sequence(path)
    assert open_sequence(path, CAMERA).camera == CAMERA


# HO-3D


def test_frames_of_ho3d_without_annotation_have_no_joints(tmp_path: Path) -> None:
    joints = KEYPOINTS.copy()
    joints[1] = np.nan
    recording = open_sequence(data_sets.write_ho3d(tmp_path, CAMERA, depths(), joints, colour_at(0)))
    truth = recording.ground_truth
    assert truth is not None
    assert truth.keypoints_at(float(recording.timestamps[1])) is None
    assert truth.keypoints_at(float(recording.timestamps[2])) is not None
    assert recording.camera.depth_scale == pytest.approx(data_sets.HO3D_UNIT)
