"""Memory, descriptors and threads do not grow; `make robustness` does the same for hours."""

import sys

import pytest

from tests.robustness.flat_resources import measure

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")


def test_nothing_grows_while_frames_are_tracked_and_trackers_opened() -> None:
    growths = list(measure(frames=12, opened=6, trackers=["ik"], backends=["raster", "oracle"]))
    assert [growth.what for growth in growths] == ["frames of ik", "trackers ik", "scorers raster", "scorers oracle"]
    assert [growth.row() for growth in growths if not growth.is_flat] == []
