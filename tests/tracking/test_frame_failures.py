"""An unexpected failure inside one frame is recorded and counted, and the run goes on."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import ArrayLike

from depthtrack.errors import DamagedFrameError, InputError
from depthtrack.hand.shape import HandShape
from depthtrack.recording.frame_failures import FAILURES_FILE, failure_text, read_failures
from depthtrack.recording.run_folder import Run, RunWriter
from depthtrack.recording.sequence import Frame
from depthtrack.recording.status import Status
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.tracking import guided_segmentation as module
from depthtrack.tracking.pipeline import Pipeline, estimates_of, replay_frames, track_frames, write_run
from depthtrack.tracking.tracker import Estimate
from tests.support.recordings import CAMERA, depth_at, pose_at

FRAMES = 8


@pytest.fixture(autouse=True)
def recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "failure_text", failure_text)


@dataclass
class Following:
    """A tracker whose pose depends on the number of poses so far; it fails in some frames."""

    failing: dict[int, Exception]
    name: str = "following"
    stages: tuple[str, ...] = ("follow",)
    poses: int = 0
    restored: list[Status] = field(default_factory=list)

    def predicted_pose(self, timestamp: float) -> None:
        return None

    def doubted_pose(self, timestamp: float) -> None:
        return None

    def start(self, observation: Observation, pose: ArrayLike | None = None) -> Estimate:
        return self.track(observation)

    def track(self, observation: Observation) -> Estimate:
        if (error := self.failing.get(observation.frame_index)) is not None:
            raise error
        estimate = Estimate(pose_at(self.poses), 1.0, 0.9, Status.TRACKED, {"follow": 1.0}, observation.timestamp)
        self.restore([estimate])
        return estimate

    def restore(self, estimates: Sequence[Estimate]) -> None:
        self.poses += sum(estimate.pose is not None for estimate in estimates)
        self.restored += [estimate.status for estimate in estimates]

    def close(self) -> None:
        return None


class Whole:
    """A segmenter that finds a hand in each whole frame; fails in some frames."""

    def __init__(self, failing: dict[int, Exception]) -> None:
        self.failing = failing

    def segment(self, frame: Frame, prior: object = None) -> Observation:
        if (error := self.failing.get(frame.index)) is not None:
            raise error
        place = {"camera": CAMERA, "silhouette": frame.depth > 0, "depth": frame.depth, "region": CAMERA.rect}
        times = {"frame_index": frame.index, "timestamp": frame.timestamp}
        fields: dict[str, Any] = {**place, **times, "centre": np.array([0.0, 0, 0.7]), "palm_radius": 0.03}
        return Observation(**fields, arm_direction=None, wrist=None)

    def alternatives(self, frame: Frame, first: Observation) -> tuple[Observation, ...]:
        return ()

    def set_lost(self, lost: bool, timestamp: float) -> None:
        return None


def frames() -> Iterator[Frame]:
    for index in range(FRAMES):
        yield Frame(index, index / 30, depth_at(index), None, CAMERA)


def run(folder: Path, segmenting: dict[int, Exception], tracking: dict[int, Exception], resume: bool = False) -> Run:
    with RunWriter(folder, {"sequence": "x"}, ("segment", "follow"), resume) as writer:
        known = estimates_of(writer.rows)
        pipeline = Pipeline(Following(tracking), cast(Segmenter, Whole(segmenting)), HandShape(), clock=lambda: 0.0)
        list(write_run(track_frames(frames(), pipeline, known), writer))
    return Run.load(folder)


SEGMENTING: dict[int, Exception] = {0: IndexError("no hand node"), 3: ZeroDivisionError('a, "b"\n\x1b[31m')}
TRACKING: dict[int, Exception] = {5: np.linalg.LinAlgError("singular"), 7: RecursionError()}


def test_failed_frames_are_absent_and_recorded(tmp_path: Path) -> None:
    found = run(tmp_path / "run", SEGMENTING, TRACKING)
    absent = [status is Status.ABSENT for status in found.status]
    assert np.flatnonzero(absent).tolist() == [0, 3, 5, 7]
    assert sorted(found.failures) == [0, 3, 5, 7]
    assert found.failures[0].startswith("IndexError in test_frame_failures.py:")
    assert found.failures[3].endswith(r"a; 'b'\n\x1b[31m")
    poses = found.poses[~np.array(absent)]
    np.testing.assert_array_equal(poses, [pose_at(k) for k in range(4)])


@pytest.mark.parametrize("kept", range(FRAMES + 1))
def test_a_resumed_run_has_the_same_bytes(tmp_path: Path, kept: int) -> None:
    run(tmp_path / "whole", SEGMENTING, TRACKING)
    run(tmp_path / "cut", SEGMENTING, TRACKING)
    for name in ("poses.csv", "timings.csv"):
        lines = (tmp_path / "cut" / name).read_text().splitlines(keepends=True)
        (tmp_path / "cut" / name).write_text("".join(lines[: kept + 1]))
    run(tmp_path / "cut", SEGMENTING, TRACKING, resume=True)
    for name in ("poses.csv", "timings.csv", "branches.csv", FAILURES_FILE):
        assert (tmp_path / "cut" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes(), name


def test_a_run_that_lacks_a_row_is_not_resumed(tmp_path: Path) -> None:
    """Its later poses would go to other frames."""
    run(tmp_path / "run", {}, {})
    lines = (tmp_path / "run" / "poses.csv").read_text().splitlines(keepends=True)
    (tmp_path / "run" / "poses.csv").write_text("".join([*lines[:3], *lines[4:6]]))
    with pytest.raises(InputError, match=r"poses.csv, line 4: expected frame 2, found 3: remove the lines"):
        run(tmp_path / "run", {}, {}, resume=True)
    assert len((tmp_path / "run" / "poses.csv").read_text().splitlines()) == 5


def test_a_sound_run_has_no_file_of_failures(tmp_path: Path) -> None:
    assert not run(tmp_path / "run", {}, {}).failures
    assert not (tmp_path / "run" / FAILURES_FILE).exists()


@pytest.mark.parametrize(
    "error",
    [DamagedFrameError("a file"), OSError(28, "No space left"), MemoryError(), ImportError("cv2"), KeyboardInterrupt()],
)
def test_other_causes_than_the_frame_end_the_run(tmp_path: Path, error: Exception) -> None:
    with pytest.raises(type(error)):
        run(tmp_path / "run", {2: error}, {})
    with pytest.raises(type(error)):
        run(tmp_path / "other", {}, {2: error})


def test_replay_passes_over_failed_segmentation() -> None:
    estimates = [Estimate(None, np.nan, 0.0, Status.ABSENT)] * FRAMES
    pairs = zip(frames(), estimates, strict=True)
    segmenter = cast(Segmenter, Whole(SEGMENTING))
    replayed = list(replay_frames(pairs, Following({}), segmenter, HandShape()))
    assert [each.frame.index for each in replayed if each.failure is not None] == sorted(SEGMENTING)


def test_a_tracker_continues_from_its_estimates_after_a_failure() -> None:
    tracker = Following(TRACKING)
    pipeline = Pipeline(tracker, cast(Segmenter, Whole({})), HandShape())
    statuses = [each.estimate.status for each in track_frames(frames(), pipeline)]
    assert tracker.restored == statuses
    assert statuses.count(Status.ABSENT) == len(TRACKING)


def test_a_malformed_file_of_failures_is_rejected(tmp_path: Path) -> None:
    (tmp_path / FAILURES_FILE).write_text("index,failure\nx,y\n")
    with pytest.raises(InputError, match="expected the numbers of frames"):
        read_failures(tmp_path)
