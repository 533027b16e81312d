"""Poses do not depend on the format of a recording."""

from pathlib import Path

import numpy as np
import pytest

import depthtrack
from depthtrack.recording import Sequence, open_sequence
from depthtrack.recording.convert import convert
from depthtrack.recording.reading import ReadingOptions
from depthtrack.types import Array
from tests.support.bags import compose
from tests.support.matroska import write_azure_kinect

FRAMES = 20


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a synthetic sequence folder."""
    path = tmp_path_factory.mktemp("formats") / "everyday"
    depthtrack.synthesise("everyday", path, model="skin", sensor="kinect1", frames=FRAMES)
    return path


def poses_of(recording: Sequence) -> Array:
    tracked = depthtrack.track(recording, "average", tracker="ik")
    poses = np.array([each.estimate.pose for each in tracked])
    assert poses.shape == (FRAMES, 27)
    return poses


@pytest.fixture(scope="module")
def expected(folder: Path) -> Array:
    return poses_of(open_sequence(folder))


@pytest.mark.parametrize("suffix", [".db3", ".mcap"])
def test_a_bag_gives_the_poses_of_the_folder(folder: Path, expected: Array, tmp_path: Path, suffix: str) -> None:
    source = open_sequence(folder)
    frames = list(source)
    bag = compose(
        lambda index: frames[index].depth, lambda index: frames[index].colour, source.camera, source.timestamps
    )
    found = poses_of(open_sequence(bag.write(tmp_path / f"film{suffix}")))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-4)


def test_a_converted_recording_gives_the_poses_of_the_folder(folder: Path, expected: Array, tmp_path: Path) -> None:
    convert(open_sequence(folder), tmp_path / "film.mcap")
    np.testing.assert_allclose(poses_of(open_sequence(tmp_path / "film.mcap")), expected, rtol=0, atol=1e-4)


def test_a_video_gives_the_poses_of_the_folder(folder: Path, tmp_path: Path) -> None:
    pytest.importorskip("av", reason="needs the extra: pip install 'depthtrack[video]'")
    source = open_sequence(folder, reading=ReadingOptions(depth_only=True))
    depths = [np.rint(frame.depth / source.camera.depth_scale).astype(np.uint16) for frame in source]
    times = source.timestamps.tolist()
    path = write_azure_kinect(tmp_path / "film.mkv", depths, [], None, times)
    np.testing.assert_allclose(poses_of(open_sequence(path, source.camera)), poses_of(source), rtol=0, atol=1e-4)
