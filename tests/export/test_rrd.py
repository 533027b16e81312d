"""Rerun's files of a run, listed by rerun's own command."""

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from depthtrack.errors import MissingExtraError
from depthtrack.export.registry import export_joints
from tests.support.tracks import moving_poses, track_of

needs_rerun = pytest.mark.skipif(find_spec("rerun") is None, reason="rerun-sdk is not installed (the extra 'view')")


@needs_rerun
def test_a_file_holds_keypoints_and_figures(tmp_path: Path) -> None:
    poses = moving_poses(4)
    poses[1] = np.nan
    export_joints(tmp_path / "a.rrd", track_of(poses))
    path, command = str(tmp_path / "a.rrd"), [sys.executable, "-m", "rerun_cli", "rrd"]
    listing = subprocess.run([*command, "print", "-v", path], capture_output=True, text=True, check=True)
    for text in ("/world/hand", "/run/confidence", "/run/energy", "Points3D:positions", "Scalars:scalars"):
        assert text in listing.stdout
    assert subprocess.run([*command, "verify", path], check=True).returncode == 0


def test_without_rerun_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'depthtrack\[view\]'"):
        export_joints(tmp_path / "a.rrd", track_of(moving_poses(1)))
    assert list(tmp_path.iterdir()) == []
