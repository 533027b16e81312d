"""A written recording reads back equal; a folder is complete or absent."""

import filecmp
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.errors import InputError
from depthtrack.geometry.camera import Camera
from depthtrack.hand.shape import HandShape
from depthtrack.recording import SequenceWriter, open_sequence, writer
from tests.support.recordings import (
    CAMERA,
    TIMES,
    colour_at,
    depth_at,
    joints_at,
    mask_at,
    pose_at,
    write_sample,
)


def everything_in(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def write_and_fail(path: Path, overwrite: bool = False) -> None:
    with SequenceWriter(path, CAMERA, overwrite=overwrite) as out:
        out.append(0.0, depth_at(0))
        raise RuntimeError("sensor unplugged")


def test_everything_written_is_read_back(tmp_path: Path) -> None:
    sequence = open_sequence(write_sample(tmp_path / "sample"))
    truth = sequence.ground_truth
    assert sequence.name == "sample"
    assert sequence.camera == CAMERA
    assert sequence.description["motion"] == "plane"
    assert sequence.description["seed"] == 3
    assert truth is not None
    assert truth.hand == sequence.hand == HandShape(side="left")
    assert sequence.has_colour
    assert truth.poses is not None
    assert truth.joints is not None
    np.testing.assert_allclose(sequence.timestamps, TIMES, atol=5e-7)
    np.testing.assert_array_equal(truth.timestamps, sequence.timestamps)
    for index, frame in enumerate(sequence):
        assert (frame.index, frame.camera, frame.depth.dtype.name) == (index, CAMERA, "float32")
        np.testing.assert_allclose(frame.depth, depth_at(index), atol=CAMERA.depth_scale / 2 + 1e-7)
        np.testing.assert_array_equal(frame.depth == 0, depth_at(index) == 0)
        np.testing.assert_array_equal(sequence.hand_mask(index), mask_at(index))
        exact = sequence.exact_depth(index)
        assert exact is not None
        np.testing.assert_allclose(exact, depth_at(index), atol=0.000025 + 1e-7)
        # JPEG loses a little, and less than a swap of red and blue would change.
        assert frame.colour is not None
        assert np.abs(frame.colour.astype(int) - colour_at(index)).mean() < 3
        # Ground truth comes back bit by bit.
        np.testing.assert_array_equal(truth.poses[index], pose_at(index))
        np.testing.assert_array_equal(truth.joints[index], joints_at(index))


def test_colour_as_png_is_exact(tmp_path: Path) -> None:
    with SequenceWriter(tmp_path / "out", CAMERA, colour_format="png") as out:
        out.append(0.0, depth_at(0), colour=colour_at(0))
    np.testing.assert_array_equal(open_sequence(tmp_path / "out")[0].colour, colour_at(0))


@given(scale=st.sampled_from([0.001, 0.0002, 0.000125, 1e-6]), seed=st.integers(0, 1000))
def test_depth_is_rounded_to_the_nearest_unit_and_dropped_out_of_range(
    tmp_path_factory: pytest.TempPathFactory, scale: float, seed: int
) -> None:
    camera = Camera(16, 8, 15.0, 15.0, 8.0, 4.0, scale)
    depth = np.random.default_rng(seed).uniform(-0.2, 1.2, camera.shape) * 65535 * scale
    depth.flat[:3] = np.nan, np.inf, -np.inf
    path = tmp_path_factory.mktemp("range") / "out"
    with SequenceWriter(path, camera, threads=1) as out:
        out.append(0.0, depth)
    read = open_sequence(path)[0].depth
    kept = (depth > 0) & (depth <= 65535.4999 * scale)
    np.testing.assert_array_equal(read[~kept], 0)
    # Half a unit, and the resolution of float32.
    assert np.abs(read[kept] - depth[kept]).max() <= scale / 2 + 65535 * scale * 2e-7


def test_the_same_input_gives_the_same_bytes_for_any_number_of_threads(tmp_path: Path) -> None:
    def write(name: str, threads: int) -> Path:
        with SequenceWriter(tmp_path / name, CAMERA, threads=threads) as out:
            for index, time in enumerate(TIMES):
                out.append(time, depth_at(index), colour=colour_at(index), pose=pose_at(index))
        return tmp_path / name

    assert everything_in(write("one", 1)) == everything_in(write("four", 4))


def test_a_recording_copied_by_the_writer_is_equal(tmp_path: Path) -> None:
    first = write_sample(tmp_path / "first")
    sequence = open_sequence(first)
    truth = sequence.ground_truth
    assert truth is not None
    assert truth.poses is not None
    assert truth.joints is not None
    with SequenceWriter(
        tmp_path / "second", sequence.camera, hand=sequence.hand, description=sequence.description
    ) as out:
        for frame in sequence:
            out.append(
                frame.timestamp,
                frame.depth,
                mask=sequence.hand_mask(frame.index),
                exact_depth=sequence.exact_depth(frame.index),
                pose=truth.poses[frame.index],
                joints=truth.joints[frame.index],
            )
    compared = filecmp.dircmp(first, tmp_path / "second")
    assert sorted(compared.left_only) == ["rgb", "rgb.txt"]
    assert compared.right_only == compared.diff_files == []
    for folder in ("depth", "hand_mask", "exact_depth"):
        assert everything_in(first / folder) == everything_in(tmp_path / "second" / folder)


def test_arrays_may_be_reused_after_append(tmp_path: Path) -> None:
    depth = np.empty(CAMERA.shape)
    with SequenceWriter(tmp_path / "out", CAMERA) as out:
        for index in range(20):
            depth[:] = 0.1 + 0.01 * index
            out.append(float(index), depth)
    for index, frame in enumerate(open_sequence(tmp_path / "out")):
        np.testing.assert_allclose(frame.depth, 0.1 + 0.01 * index, atol=1e-6)


def test_an_error_in_the_block_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="unplugged"):
        write_and_fail(tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


def test_an_error_of_a_worker_is_raised_and_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full_disk(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(writer, "write_png", full_disk)
    with pytest.raises(OSError, match="No space left"), SequenceWriter(tmp_path / "out", CAMERA) as out:
        out.append(0.0, depth_at(0))
    assert list(tmp_path.iterdir()) == []


def test_an_empty_recording_is_rejected(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="needs at least one frame"), SequenceWriter(tmp_path / "out", CAMERA):
        pass
    assert list(tmp_path.iterdir()) == []


def test_an_existing_recording_is_kept_without_overwrite(tmp_path: Path) -> None:
    path = write_sample(tmp_path / "out")
    before = everything_in(path)
    with pytest.raises(InputError, match="exists already"), SequenceWriter(path, CAMERA):
        pass
    with pytest.raises(RuntimeError, match="unplugged"):
        write_and_fail(path, overwrite=True)
    assert everything_in(path) == before
    with SequenceWriter(path, CAMERA, overwrite=True) as out:
        out.append(0.0, depth_at(0))
        assert everything_in(path) == before
    assert len(open_sequence(path)) == 1
    assert not (path / "joints.csv").exists()
    assert list(tmp_path.iterdir()) == [path]


def test_only_recordings_are_ever_overwritten(tmp_path: Path) -> None:
    (tmp_path / "home").mkdir()
    (tmp_path / "home" / "thesis.tex").write_text("precious")
    (tmp_path / "link").symlink_to(tmp_path / "home")
    for name in ("home", "home/thesis.tex", "link"):
        with (
            pytest.raises(InputError, match="is not a sequence folder"),
            SequenceWriter(tmp_path / name, CAMERA, overwrite=True),
        ):
            pass
    assert (tmp_path / "home" / "thesis.tex").read_text() == "precious"


def test_an_empty_folder_is_filled(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    assert len(open_sequence(write_sample(tmp_path / "out"))) == len(TIMES)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"timestamp": 0.0}, "must increase"),
        ({"timestamp": 1.0 + 1e-8}, "must increase"),
        ({"timestamp": float("nan")}, "must be finite"),
        ({"depth": np.zeros((3, 3))}, "depth must have the camera's shape"),
        ({"colour": np.zeros(CAMERA.shape, np.uint8)}, "rgb must have the camera's shape"),
        ({"joints": joints_at(0)}, "must have pose, joints or both alike"),
        ({"pose": np.full(27, np.nan)}, "finite numbers"),
        ({"pose": np.zeros(26)}, "finite numbers"),
        ({"pose": np.full(27, 0.1)}, "quaternion must have length 1"),
        ({"colour": np.zeros((*CAMERA.shape, 3))}, "must be 8-bit RGB"),
    ],
)
def test_unusable_frames_are_rejected(tmp_path: Path, arguments: dict[str, Any], message: str) -> None:
    with SequenceWriter(tmp_path / "out", CAMERA) as out:
        out.append(1.0, depth_at(0), pose=pose_at(0))
        with pytest.raises(InputError, match=message):
            out.append(**{"timestamp": 2.0, "depth": depth_at(1), **arguments})
    # No part of the rejected frame was written.
    assert len(open_sequence(tmp_path / "out")) == len(list((tmp_path / "out" / "depth").iterdir())) == 1
