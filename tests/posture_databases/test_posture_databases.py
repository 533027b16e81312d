"""Readers of posture databases return the written angles and reject bad files."""

import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.hand.kinematics import KEYPOINT_NAMES, HandModel
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.pose import ANGLE_NAMES, POSE_NAMES, make_pose
from depthtrack.hand.shape import HandShape, Side
from depthtrack.hand.synergies import Synergies
from depthtrack.posture_databases.mat import REST
from depthtrack.posture_databases.posture_set import MAX_POSTURES
from depthtrack.posture_databases.registry import read_postures
from depthtrack.recording.numpy_arrays import read_arrays


def random_angles(seed: int, count: int) -> np.ndarray:
    angles = np.random.default_rng(seed).uniform(LOWER, UPPER, (count, 20))
    angles[:, ANGLE_NAMES.index("middle_mcp_abduction")] = 0
    return np.asarray(angles)


def random_keypoints(seed: int, angles: np.ndarray, side: Side = "right", scale: float = 1.0) -> np.ndarray:
    """Return keypoints (N, 21, 3), metres, of hands at random positions."""
    rng = np.random.default_rng(seed)
    poses = make_pose(rng.uniform(-0.3, 0.3, (len(angles), 3)), rng.normal(size=(len(angles), 4)), angles)
    return HandModel(HandShape(side=side, scale=scale)).keypoints(poses)


def write_csv(path: Path, header: tuple[str, ...], rows: Any) -> Path:
    lines = [",".join(header), *(",".join(map(str, row)) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_the_papers_format_is_read_in_our_signs(tmp_path: Path) -> None:
    """Zero is the rest posture of their mesh; flexion is negative; global columns are left out."""
    rows = np.zeros((2, 26))
    rows[:, :6] = 99
    rows[1, 6 + 5] = -np.radians(40)  # index, first flexion
    path = tmp_path / "database.mat"
    np.savetxt(path, rows)
    found = read_postures(path).angles
    np.testing.assert_allclose(found[0], REST)
    change = np.degrees(found[1] - found[0])
    expected = np.zeros(20)
    expected[ANGLE_NAMES.index("index_mcp_flexion")] = 40
    np.testing.assert_allclose(change, expected, atol=1e-12)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "one or more postures, found none"),
        ("1 2 3\n", "26 finite numbers"),
        (" ".join(["0"] * 27), "26 finite numbers"),
        (" ".join(["0"] * 25 + ["nan"]), "26 finite numbers"),
        (" ".join(["0"] * 25 + ["x"]), "26 finite numbers"),
        (" ".join(["45"] * 26), "must be radians"),
        ("MATLAB 5.0 MAT-file, Platform: GLNXA64", "save"),
    ],
)
def test_malformed_databases_are_rejected(tmp_path: Path, text: str, reason: str) -> None:
    path = tmp_path / "database.mat"
    path.write_text(text)
    with pytest.raises(InputError, match=reason):
        read_postures(path)


def test_tables_of_angles_are_read_by_name(tmp_path: Path) -> None:
    angles = random_angles(1, 5)
    in_radians = write_csv(tmp_path / "radians.csv", ANGLE_NAMES, angles)
    np.testing.assert_allclose(read_postures(in_radians).angles, angles)
    # Columns have any order, with others between them; a row of a run may have no pose.
    order = np.random.default_rng(1).permutation(20)
    header = ("time", *(f"{ANGLE_NAMES[k]}_deg" for k in order), "note")
    rows = [[i, *np.degrees(row[order]), "seen"] for i, row in enumerate(angles)]
    rows.insert(2, [9, *[""] * 20, "absent"])
    in_degrees = write_csv(tmp_path / "degrees.csv", header, rows)
    np.testing.assert_allclose(read_postures(in_degrees).angles, angles)


def test_recordings_and_runs_are_read_from_their_folders(tmp_path: Path) -> None:
    angles = random_angles(2, 4)
    rows = [[i, 0, 0, 1, 1, 0, 0, 0, *row] for i, row in enumerate(angles)]
    for name in ("hand_poses.csv", "poses.csv"):
        folder = tmp_path / name.removesuffix(".csv")
        folder.mkdir()
        write_csv(folder / name, ("timestamp", *POSE_NAMES), rows)
        np.testing.assert_allclose(read_postures(folder).angles, angles)


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("unit", [1.0, 100.0, 1000.0])
def test_tables_of_joints_of_any_unit_and_side_are_fitted(tmp_path: Path, side: Side, unit: float) -> None:
    angles = random_angles(3, 12)
    keypoints = random_keypoints(3, angles, side, scale=0.9) * unit
    header = ("timestamp", *(f"{name}_{axis}" for name in KEYPOINT_NAMES for axis in "xyz"))
    rows = [[i, *row] for i, row in enumerate(keypoints.reshape(12, -1))]
    rows[4][1 + 3 * 9] = ""  # a joint of one hand is not known
    found = read_postures(write_csv(tmp_path / "joints.csv", header, rows))
    assert found.misfit == pytest.approx(0, abs=1e-6)
    others = [k for k in range(12) if k != 4]
    np.testing.assert_allclose(found.angles[others], angles[others], atol=1e-3)


@pytest.mark.parametrize(
    ("header", "rows", "reason"),
    [
        (("a", "b"), [[1, 2]], "expected columns"),
        (ANGLE_NAMES, [], "one or more postures, found none"),
        (ANGLE_NAMES, [[0.1] * 19], "row 1"),
        (ANGLE_NAMES, [[0.1] * 19 + ["x"]], "row 1"),
        (ANGLE_NAMES, [[0.1] * 19 + [""]], "all 20 angles"),
        (ANGLE_NAMES, [[30] * 20], "must be radians"),
        (ANGLE_NAMES, [["1e300"] * 20], "expected numbers up to"),
        (("wrist_x", "wrist_y", "wrist_z"), [[0, 0, 0]], "all joints of a finger"),
    ],
)
def test_malformed_tables_are_rejected(tmp_path: Path, header: tuple[str, ...], rows: Any, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        read_postures(write_csv(tmp_path / "table.csv", header, rows))


def test_joints_must_be_of_human_size(tmp_path: Path) -> None:
    keypoints = random_keypoints(4, random_angles(4, 5)) * 0.1
    np.savez(tmp_path / "tiny.npz", joints=keypoints)
    with pytest.raises(InputError, match="to the size of a hand"):
        read_postures(tmp_path / "tiny.npz")


def test_tracks_of_several_hands_are_read_and_chosen_by_name(tmp_path: Path) -> None:
    """Two hands of different size and side in one array of millimetres, without wrists."""
    angles = random_angles(5, 30)
    right, left = random_keypoints(5, angles[:20], "right", 0.8), random_keypoints(6, angles[20:], "left", 1.2)
    path = tmp_path / "hands.npz"
    joints = (1000 * np.concatenate([right, left])[:, 1:]).reshape(-1, 5, 4, 3)
    start, length, right_hand, name = (
        np.array([0, 20]),
        np.array([20, 10]),
        np.array([1, 0]),
        np.array(["wave", "grab"]),
    )
    np.savez_compressed(path, joints=joints, start=start, length=length, right=right_hand, name=name)
    found = read_postures(path)
    np.testing.assert_allclose(found.angles, angles, atol=2e-3)
    grabs = found.only(["grab"])
    np.testing.assert_array_equal(grabs.angles, found.angles[20:])
    with pytest.raises(InputError, match="grab, wave"):
        found.only(["clap"])


@pytest.mark.parametrize("shape", [(10, 21, 3), (10, 20, 3)])
def test_a_single_hand_needs_only_its_joints(tmp_path: Path, shape: tuple[int, ...]) -> None:
    angles = random_angles(7, 10)
    keypoints = random_keypoints(7, angles, "left")[:, 21 - shape[1] :]
    np.savez(tmp_path / "hand.npz", joints=keypoints.astype(np.float32))
    np.testing.assert_allclose(read_postures(tmp_path / "hand.npz").angles, angles, atol=5e-3)


@pytest.mark.parametrize(
    ("arrays", "reason"),
    [
        ({"other": np.zeros(3)}, "expected an array 'joints'"),
        ({"joints": np.zeros((4, 7, 3))}, "N, 21, 3"),
        ({"joints": np.zeros((0, 21, 3))}, "N, 21, 3"),
        ({"joints": np.zeros((4, 21, 3), dtype="U4")}, "N, 21, 3"),
        ({"joints": np.full((4, 21, 3), 1e9)}, "kilometre"),
        ({"joints": np.full((4, 21, 3), np.nan)}, "all joints of a finger"),
        ({"joints": np.array([None] * 3)}, "numbers or names"),
        ({"joints": np.zeros((4, 21, 3)), "start": [0], "length": [9]}, "each track"),
        ({"joints": np.zeros((4, 21, 3)), "start": [-1], "length": [2]}, "each track"),
        ({"joints": np.zeros((4, 21, 3)), "start": [0, 1], "length": [4]}, "same shape"),
        ({"joints": np.zeros((4, 21, 3)), "start": [0.5], "length": [2.0]}, "whole numbers"),
        ({"joints": np.zeros((4, 21, 3)), "start": [0] * 9, "length": [MAX_POSTURES] * 9}, "more than"),
        ({"joints": np.zeros((4, 21, 3)), "right": [True, False]}, "one element for each"),
    ],
)
def test_malformed_arrays_are_rejected(tmp_path: Path, arrays: dict[str, Any], reason: str) -> None:
    path = tmp_path / "hands.npz"
    np.savez(path, **arrays)
    with pytest.raises(InputError, match=reason):
        read_postures(path)


def write_member(path: Path, header: str, data: bytes = b"") -> None:
    """Write an .npz whose 'joints' have this header."""
    text = header.encode().ljust(118) + b"\n"
    member = b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + data
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("joints.npy", member)


@pytest.mark.parametrize(
    ("header", "reason"),
    [
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000, 21, 3)}", "must have at most"),
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (-1, -21, 3)}", "as NumPy writes it"),
        ("{'descr': '|O', 'fortran_order': False, 'shape': (1, 21, 3)}", "numbers or names"),
        ("{'descr': [('x', '<f8')], 'fortran_order': False, 'shape': (1, 21, 3)}", "numbers or names"),
        ("{'descr': '<U0', 'fortran_order': False, 'shape': (1, 21, 3)}", "undamaged|found"),
        ("{'shape': __import__('os')}", "as NumPy writes it"),
        ("(" * 110, "as NumPy writes it"),
        ("{'descr': '\0', 'fortran_order': False, 'shape': (1, 21, 3)}", "as NumPy writes it"),
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (0, 21, 3)}", "must be numbers"),
        ("{'descr': '<f3', 'fortran_order': False, 'shape': (1, 21, 3)}", "as NumPy writes it|undamaged"),
    ],
)
def test_false_headers_reserve_no_memory(tmp_path: Path, header: str, reason: str) -> None:
    path = tmp_path / "hands.npz"
    write_member(path, header)
    with pytest.raises(InputError, match=reason):
        read_postures(path)


@pytest.mark.parametrize("dtype", ["<f4", ">f8", "<i2", "|u1", "<f2", "<U5", ">U3", "|b1"])
@pytest.mark.parametrize("shape", [(), (0,), (7,), (2, 3, 4)])
@pytest.mark.parametrize("version", [(1, 0), (2, 0)])
def test_arrays_are_read_as_numpy_writes_them(
    tmp_path: Path, dtype: str, shape: tuple[int, ...], version: tuple[int, int]
) -> None:
    rng, path = np.random.default_rng(1), tmp_path / "arrays.npz"
    for written in (rng.integers(0, 2, shape), np.asfortranarray(rng.integers(0, 2, shape))):
        array = written.astype(dtype)
        member = io.BytesIO()
        np.lib.format.write_array(member, array, version)
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("a.npy", member.getvalue())
        found = read_arrays(path, ("a", "b"))
        assert list(found) == ["a"]
        assert found["a"].dtype == array.dtype
        np.testing.assert_array_equal(found["a"], array)


def test_names_of_half_characters_and_short_arrays_are_rejected(tmp_path: Path) -> None:
    header = "{'descr': '<U1', 'fortran_order': False, 'shape': (1,), }"
    write_member(tmp_path / "a.npz", header, b"\0\xd8\0\0")
    with pytest.raises(InputError, match="Unicode characters"):
        read_arrays(tmp_path / "a.npz", ("joints",))


def test_damaged_archives_are_rejected(tmp_path: Path) -> None:
    path, whole = tmp_path / "hands.npz", io.BytesIO()
    np.savez(whole, joints=np.ones((50, 21, 3)))
    data = whole.getvalue()
    for damaged in (b"", b"PK", data[:-40], data[:300] + b"\xff" * 50 + data[350:]):
        path.write_bytes(damaged)
        with pytest.raises(InputError, match=r"hands\.npz"):
            read_postures(path)


def test_a_path_without_a_database_is_rejected(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_postures(tmp_path / "nowhere.mat")
    (tmp_path / "notes.txt").write_text("hello")
    for path in (tmp_path / "notes.txt", tmp_path):
        with pytest.raises(InputError, match=r"expected a \.mat"):
            read_postures(path)


def test_the_papers_own_database(real_data: Path) -> None:
    """Flexion covers the joints' range, and fewer components than the paper's suffice."""
    path = real_data / "postures" / "schroeder-fingerfist" / "fingerfist.mat"
    if not path.exists():
        pytest.skip(f"no such database: {path}")
    angles = read_postures(path).angles
    assert angles.shape == (6000, 20)
    flexions = np.degrees(angles.reshape(-1, 5, 4)[:, 1:, 1:3])
    assert np.all(np.percentile(flexions, 1, axis=0) > -25)
    assert np.all(np.percentile(flexions, 99, axis=0) > 55)
    assert np.all(np.percentile(flexions, 99, axis=0) < 130)
    # At rest all fingers are nearly straight and parallel, so the zeros are right.
    rest = np.degrees(np.median(angles[np.argsort(np.abs(flexions).sum(axis=(1, 2)))[:600]], axis=0)).reshape(5, 4)[1:]
    assert np.abs(rest[:, 1:]).max() < 15
    assert np.all(np.diff(rest[:, 0]) < 0)
    synergies = Synergies.fit(angles)
    assert [synergies.variance_share(3), synergies.variance_share(6)] == pytest.approx([0.854, 0.968], abs=2e-3)


def test_real_joint_recordings(real_data: Path) -> None:
    path = real_data / "postures" / "leap" / "leap_hands.npz"
    if not path.exists():
        pytest.skip(f"no such recordings: {path}")
    with np.load(path) as arrays:
        joints, start, length = arrays["joints"], arrays["start"], arrays["length"]
        grasps = np.flatnonzero(np.isin(arrays["name"], ["grab", "pinch"]))
    chosen = np.concatenate([np.arange(start[i], start[i] + length[i]) for i in grasps])[::4]
    from depthtrack.posture_databases.joint_postures import postures_of_joints

    keypoints = np.full((len(chosen), 21, 3), np.nan)
    keypoints[:, 1:] = joints[chosen].reshape(-1, 20, 3)
    found = postures_of_joints(path, keypoints)
    assert found.misfit is not None
    assert found.misfit < 0.0025
    assert Synergies.fit(found.angles).variance_share(3) > 0.9
