"""Recordings that the tests of the public interface share."""

from pathlib import Path

import pytest

import depthtrack as dt

FRAMES = 4


@pytest.fixture(scope="session")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of a hand with a skin, in colour, by a noisy sensor in a room."""
    folder = tmp_path_factory.mktemp("api") / "everyday"
    dt.synthesise("everyday", folder, frames=FRAMES, model="skin", sensor="kinect1", background="room")
    return folder


@pytest.fixture(scope="session")
def run(path: Path, tmp_path_factory: pytest.TempPathFactory) -> dt.Run:
    """A run of the recording by the fastest tracker."""
    return dt.track(path, "truth", dt.tracker_config("ik", resolution=64), out=tmp_path_factory.mktemp("api") / "run")
