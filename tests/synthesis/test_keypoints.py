"""Synthetic keypoints: their errors, and the file beside the recording."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from depthtrack.cli import main
from depthtrack.errors import InputError
from depthtrack.recording.keypoints import KEYPOINTS_FILE, read_keypoints
from depthtrack.recording.sequence import ImageKeypoints
from depthtrack.synthesis.generate import write_recording
from depthtrack.synthesis.keypoints import KeypointErrors, detected_keypoints
from depthtrack.types import Array
from tests.support.synthesis import synthesiser

FRAMES = 200


def detected(errors: KeypointErrors, seed: int = 0) -> tuple[list[ImageKeypoints], Array]:
    """Return the keypoints of many frames of one pose, and the true pixels (21, 2)."""
    made = synthesiser(frames=1)
    camera, joints = made.sensor.camera, made.joints[0]
    rngs = (np.random.default_rng([seed, frame]) for frame in range(FRAMES))
    return [detected_keypoints(joints, camera, "right", errors, rng) for rng in rngs], camera.project(joints)


def test_without_errors_they_are_the_projected_joints() -> None:
    found, truth = detected(KeypointErrors())
    np.testing.assert_array_equal(found[0].pixels, truth)
    assert found[0].side == "right"


def test_errors_have_the_stated_size() -> None:
    found, truth = detected(KeypointErrors(noise=4.0, missing=0.1))
    offsets = np.stack([each.pixels for each in found]) - truth
    unknown = np.isnan(offsets).any(axis=-1)
    assert np.nanstd(offsets) == pytest.approx(4.0, rel=0.05)
    assert unknown.mean() == pytest.approx(0.1, abs=0.02)
    np.testing.assert_array_equal(unknown, [each.confidence == 0 for each in found])


def test_swaps_exchange_neighbouring_fingers() -> None:
    found, truth = detected(KeypointErrors(swaps=0.25))
    swapped = [each.pixels for each in found if not np.array_equal(each.pixels, truth)]
    assert len(swapped) / FRAMES == pytest.approx(0.25, abs=0.1)
    for pixels in swapped:
        fingers = [int(np.flatnonzero((truth[1::4] == tip).all(axis=-1))[0]) for tip in pixels[1::4]]
        assert sorted(fingers) == list(range(5))
        moved = np.flatnonzero(np.array(fingers) != range(5))
        assert np.diff(moved).tolist() == [1]


@pytest.mark.parametrize("errors", [{"noise": -1}, {"missing": 1.1}, {"swaps": float("nan")}])
def test_errors_out_of_range_are_rejected(errors: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="must lie between 0 and"):
        KeypointErrors(**errors)


def test_the_recording_is_the_same_without_its_keypoints(tmp_path: Path) -> None:
    options: dict[str, Any] = {"motion": "random", "sensor": "kinect1", "frames": 3, "seed": 2}
    write_recording(synthesiser(**options), tmp_path / "without")
    write_recording(synthesiser(**options, keypoints=KeypointErrors(2.0, 0.1)), tmp_path / "with", threads=3)
    write_recording(synthesiser(**options, keypoints=KeypointErrors(2.0, 0.1)), tmp_path / "again", threads=1)
    files = [path.relative_to(tmp_path / "without") for path in (tmp_path / "without").rglob("*") if path.is_file()]
    assert Path(KEYPOINTS_FILE) not in files
    for file in files:
        if file.name != "sequence.json":
            assert (tmp_path / "without" / file).read_bytes() == (tmp_path / "with" / file).read_bytes()
    written = [(tmp_path / name / KEYPOINTS_FILE).read_bytes() for name in ("with", "again")]
    assert written[0] == written[1]


def test_the_command_writes_a_file_that_is_read(tmp_path: Path) -> None:
    options = ("--frames", "4", "--keypoints", "--keypoint-noise", "0", "--missing-keypoints", "0")
    assert main(["synth", "everyday", str(tmp_path / "made"), "--side", "left", *options]) == 0
    found, made = read_keypoints(tmp_path / "made" / KEYPOINTS_FILE), synthesiser(frames=4)
    assert found.side == "left"
    np.testing.assert_allclose(found.keys, made.timestamps, atol=1e-6)
    assert found.rows(made.timestamps).tolist() == [0, 1, 2, 3]
    assert np.isfinite(found.pixels).all()
