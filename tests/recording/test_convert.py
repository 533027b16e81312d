"""A converted recording holds the same frames, and is complete or absent."""

import os
from pathlib import Path

import numpy as np
import pytest

from depthtrack.cli import main
from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.recording import SequenceWriter, open_sequence
from depthtrack.recording.convert import convert
from depthtrack.recording.sequence import ImageKeypoints
from tests.support.recordings import CAMERA, TIMES, depth_at, write_sample


@pytest.fixture
def sample(tmp_path: Path) -> Path:
    return write_sample(tmp_path / "sample")


def check_equal(first: Path, second: Path) -> None:
    """Check that both recordings have the same frames and camera."""
    a, b = open_sequence(first), open_sequence(second)
    assert len(a) == len(b)
    assert a.camera == b.camera
    for one, other in zip(a, b, strict=True):
        assert one.timestamp == pytest.approx(other.timestamp, abs=1e-6)
        np.testing.assert_array_equal(one.depth, other.depth)
        np.testing.assert_array_equal(one.colour, other.colour)


def test_a_folder_survives_mcap(sample: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["convert", str(sample), str(tmp_path / "film.mcap")]) == 0
    assert main(["convert", str(tmp_path / "film.mcap"), str(tmp_path / "again")]) == 0
    assert f"{len(TIMES)} frames" in capsys.readouterr().out
    check_equal(sample, tmp_path / "film.mcap")
    check_equal(sample, tmp_path / "again")
    assert [each.name for each in tmp_path.glob(".*")] == []


def test_an_mcap_file_has_the_same_bits_from_another_process(
    sample: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for process in (1, 2):
        monkeypatch.setattr(os, "getpid", lambda process=process: process)
        convert(open_sequence(sample), tmp_path / "film.mcap", overwrite=True)
        (tmp_path / "film.mcap").replace(tmp_path / str(process))
    assert (tmp_path / "1").read_bytes() == (tmp_path / "2").read_bytes()


def test_a_folder_keeps_its_ground_truth_in_a_folder(sample: Path, tmp_path: Path) -> None:
    assert convert(open_sequence(sample), tmp_path / "copy", frames=3) == 3
    a, b = open_sequence(sample), open_sequence(tmp_path / "copy")
    assert a.ground_truth is not None
    assert b.ground_truth is not None
    np.testing.assert_array_equal(a.ground_truth.poses[:3], b.ground_truth.poses)  # type: ignore[index]
    np.testing.assert_array_equal(a.ground_truth.joints[:3], b.ground_truth.joints)  # type: ignore[index]
    np.testing.assert_array_equal(a.hand_mask(1), b.hand_mask(1))
    np.testing.assert_array_equal(a.exact_depth(1), b.exact_depth(1))
    assert b.hand == a.hand


def test_a_folder_keeps_its_keypoints(tmp_path: Path) -> None:
    keypoints = ImageKeypoints(np.arange(42, dtype=np.float64).reshape(21, 2), np.full(21, 0.5), "left")
    with SequenceWriter(tmp_path / "sample", CAMERA) as writer:
        for index, time in enumerate(TIMES):
            writer.append(time, depth_at(index), keypoints=keypoints)
    convert(open_sequence(tmp_path / "sample"), tmp_path / "copy")
    a, b = (tmp_path / name / "keypoints.csv" for name in ("sample", "copy"))
    assert a.read_text() == b.read_text()


def test_depth_in_other_units_than_millimetres_keeps_its_steps(sample: Path, tmp_path: Path) -> None:
    text = (sample / "camera.json").read_text().replace("0.001", "0.0001")
    (sample / "camera.json").write_text(text)
    convert(open_sequence(sample), tmp_path / "film.mcap")
    check_equal(sample, tmp_path / "film.mcap")


@pytest.mark.parametrize("name", ["film.mcap", "copy"])
def test_an_output_is_complete_or_absent(sample: Path, tmp_path: Path, name: str) -> None:
    (sample / "depth" / f"{TIMES[3]:.6f}.png").write_bytes(b"")
    with pytest.raises(DamagedFrameError):
        convert(open_sequence(sample), tmp_path / name)
    assert [each.name for each in tmp_path.iterdir()] == ["sample"]
    assert convert(open_sequence(sample, on_damage="skip"), tmp_path / name) == len(TIMES) - 1


@pytest.mark.parametrize("name", ["film.mcap", "copy"])
def test_an_existing_output_is_kept_unless_asked(sample: Path, tmp_path: Path, name: str) -> None:
    convert(open_sequence(sample), tmp_path / name, frames=1)
    with pytest.raises(InputError, match="exists already"):
        convert(open_sequence(sample), tmp_path / name)
    convert(open_sequence(sample), tmp_path / name, overwrite=True)
    assert len(open_sequence(tmp_path / name)) == len(TIMES)


def test_mistakes_give_one_sentence(sample: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["convert", str(sample), str(tmp_path / "nowhere" / "film.mcap")]) == 2
    assert "does not exist" in capsys.readouterr().err
    assert main(["convert", str(sample), str(tmp_path / "film.mcap"), "--frames", "0"]) == 2
    assert "--frames must be from 1" in capsys.readouterr().err


def test_depth_beyond_16_bits_becomes_none(sample: Path, tmp_path: Path) -> None:
    from depthtrack.recording.bags.writer import McapWriter

    far = depth_at(0)
    far[20, 20] = 70.0
    with McapWriter(tmp_path / "film.mcap", CAMERA) as writer:
        writer.append(0.5, far)
    assert open_sequence(tmp_path / "film.mcap")[0].depth[20, 20] == 0
