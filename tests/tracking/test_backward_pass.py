"""The backward pass: its stretches, the direction, and the same bits after an interruption."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from depthtrack.errors import InputError
from depthtrack.evaluation.replay import Replay
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.shape import HandShape
from depthtrack.recording.frame_failures import failure_text
from depthtrack.recording.registry import open_sequence
from depthtrack.recording.run_folder import Run, RunWriter
from depthtrack.recording.sequence import Frame
from depthtrack.recording.status import Status
from depthtrack.segmentation.observation import Observation
from depthtrack.segmentation.segmenter import Segmenter
from depthtrack.synthesis.generate import Synthesis, Synthesiser, write_recording
from depthtrack.tracking import guided_segmentation, pipeline
from depthtrack.tracking.backward_options import BackwardOptions, chosen_backward
from depthtrack.tracking.backward_pass import doubtful_stretches, track_backwards, with_forward_status
from depthtrack.tracking.change_of_direction import Motion, change_of_direction
from depthtrack.tracking.configuration import HybridConfig, IkConfig, Oikonomidis2011Config
from depthtrack.tracking.guided_segmentation import segment
from depthtrack.tracking.run import TrackingRun, configure
from depthtrack.tracking.run_configuration import RunConfiguration
from depthtrack.tracking.tracker import ABSENT, Estimate, Guide, Tracker
from depthtrack.types import Array
from tests.support.recordings import CAMERA, pose_at

OPTIONS = BackwardOptions()
CLAMP = 40.0
FRAMES, CLEAR = 40, 25


def estimate(confidence: float, energy: float = 10.0, status: Status = Status.TRACKED) -> Estimate:
    return Estimate(pose_at(0), energy, 0.9, status, {}, 0.0, confidence)


def test_stretches_lie_between_confident_poses_and_hold_a_doubtful_one() -> None:
    confidences = [0.1, 0.4, 0.6, 0.4, 0.7, 0.2, 0.9, 0.9, 0.1]
    found = doubtful_stretches([estimate(each) for each in confidences], OPTIONS)
    assert [tuple(each) for each in found] == [
        (0, 2),
        (5, 6),
    ]  # 0.4 is not doubtful, nothing follows the last


def test_frames_without_a_trusted_pose_are_doubtful_and_unknown_confidences_are_not() -> None:
    lost = estimate(0.9, status=Status.LOST)
    assert [tuple(each) for each in doubtful_stretches([ABSENT, lost, estimate(0.8)], OPTIONS)] == [(0, 2)]
    assert doubtful_stretches([estimate(math.nan)] * 3, OPTIONS) == []


def moved(confidence: float, energy: float, x: float) -> Estimate:
    """Return an estimate whose hand is moved to `x`, metres."""
    pose = pose_at(0)
    pose[0] = x
    return replace(estimate(confidence, energy), pose=pose)


def place(pose: Array) -> Array:
    """Return one keypoint."""
    return pose[None, :3]


def motion_of(ahead: Sequence[Estimate], back: Sequence[Estimate], before: Estimate | None, after: Estimate) -> Motion:
    return Motion.between(ahead, back, (before, after), place)


_KNOWN = st.builds(moved, st.floats(0, 1), st.floats(0, 60), st.floats(-0.3, 0.3))
_ESTIMATES = _KNOWN | st.just(ABSENT)


@given(st.lists(st.tuples(_ESTIMATES, _ESTIMATES), max_size=8), st.none() | _KNOWN, _KNOWN, st.floats(0, 50))
def test_the_change_of_direction_has_the_least_sum_of_costs(
    pairs: list[tuple[Estimate, Estimate]], before: Estimate | None, after: Estimate, weight: float
) -> None:
    ahead, back = [pair[0] for pair in pairs], [pair[1] for pair in pairs]

    def cost(each: Estimate) -> float:
        return 1.0 if each.pose is None else min(each.energy / CLAMP, 1.0) - 0.5 * each.confidence

    def last_known(estimates: Sequence[Estimate | None]) -> Estimate | None:
        return next((each for each in reversed(estimates) if each is not None and each.pose is not None), None)

    def way(change: int) -> float:
        path = [before, *(last_known([before, *ahead[: n + 1]]) for n in range(change))]
        path += [last_known([after, *back[n:][::-1]]) for n in range(change, len(back))]
        known = [each.pose for each in (*path, after) if each is not None and each.pose is not None]
        return sum(float(np.linalg.norm(other[:3] - one[:3])) for one, other in pairwise(known))

    def total(change: int) -> float:
        costs = sum(map(cost, ahead[:change])) + sum(cost(each) + 0.1 for each in back[change:])
        return costs + weight * way(change)

    options = replace(OPTIONS, confidence_weight=0.5, gain=0.1, motion_weight=weight)
    change = change_of_direction(ahead, back, motion_of(ahead, back, before, after), CLAMP, options)
    assert total(change) == pytest.approx(min(map(total, range(len(pairs) + 1))))


def test_equal_estimates_of_both_directions_stay_forward() -> None:
    same = [estimate(0.2), estimate(0.1)]
    motion = motion_of(same, same, None, estimate(0.9))
    assert change_of_direction(same, same, motion, CLAMP, replace(OPTIONS, gain=0.0)) == 2


def test_a_hand_does_not_leap_to_backward_poses_for_a_little_energy() -> None:
    ahead = [moved(0.1, 16.0, 0.005 * n) for n in range(6)]
    back = [moved(0.1, 14.0, 0.2) for n in range(4)] + [moved(0.1, 10.0, 0.005 * n) for n in (4, 5)]
    motion = motion_of(ahead, back, ahead[0], ahead[-1])
    options = replace(OPTIONS, gain=0.0)
    assert change_of_direction(ahead, back, motion, CLAMP, options) == 4
    assert change_of_direction(ahead, back, motion, CLAMP, replace(options, motion_weight=0.0)) == 0


def test_a_stretch_begins_after_its_last_pause() -> None:
    times = (0.0, 0.1, 1.1, 1.2, 2.2, 2.3)
    doubtful = [replace(estimate(0.1), timestamp=time) for time in times]
    ended = replace(estimate(0.9), timestamp=2.4)
    assert [tuple(each) for each in doubtful_stretches([*doubtful, ended], OPTIONS)] == [(4, 6)]
    assert doubtful_stretches([*doubtful, replace(ended, timestamp=3.3)], OPTIONS) == []


def test_a_trusted_pose_after_a_frame_without_one_starts_the_track() -> None:
    lost = estimate(0.0, status=Status.LOST)
    ordered = with_forward_status(
        [ABSENT, lost, lost, estimate(0.9)], {1: estimate(0.4), 2: estimate(0.4, status=Status.STARTED)}
    )
    assert [each.status for each in ordered.values()] == [Status.STARTED, Status.TRACKED]


def test_a_forward_start_after_a_pose_of_the_backward_pass_continues_it() -> None:
    begun = estimate(0.9, status=Status.STARTED)
    ordered = with_forward_status([ABSENT, begun, estimate(0.9)], {0: estimate(0.4)})
    assert {place: each.status for place, each in ordered.items()} == {0: Status.STARTED, 1: Status.TRACKED}
    assert list(with_forward_status([ABSENT, begun], {0: estimate(0.4, status=Status.LOST)})) == [0]


def test_trackers_of_papers_and_those_with_a_deadline_go_forward_alone() -> None:
    assert chosen_backward(None, HybridConfig()) == OPTIONS
    assert chosen_backward(None, IkConfig(deadline=33.0)) is None
    assert chosen_backward(None, Oikonomidis2011Config()) is None
    assert chosen_backward(True, Oikonomidis2011Config()) == OPTIONS
    assert chosen_backward(False, HybridConfig()) is None
    assert chosen_backward(replace(OPTIONS, gain=0.2), HybridConfig()) == replace(OPTIONS, gain=0.2)


class BadStart:
    """The given tracker, but its first forward poses are wrong and doubtful."""

    def __init__(self, tracker: Tracker, pose: Array) -> None:
        self._tracker, self._pose, self.name, self.stages = tracker, pose, tracker.name, tracker.stages

    def predicted_pose(self, timestamp: float) -> Array | None:
        return self._tracker.predicted_pose(timestamp)

    def doubted_pose(self, timestamp: float) -> Array | None:
        return self._tracker.doubted_pose(timestamp)

    def start(self, observation: Observation, pose: ArrayLike | None = None) -> Estimate:
        return self._tracker.start(observation, pose)

    def track(self, observation: Observation) -> Estimate:
        found = self._tracker.track(observation)
        backwards = math.copysign(1.0, observation.timestamp) < 0  # also at the time 0
        if backwards or observation.timestamp >= CLEAR / 30 - 1e-6:
            return found
        return replace(found, pose=self._pose, energy=30.0, confidence=0.05)

    def restore(self, estimates: Sequence[Estimate]) -> None:
        self._tracker.restore(estimates)

    def close(self) -> None:
        self._tracker.close()


def bad_start(tracker: Tracker) -> Tracker:
    return BadStart(tracker, pose_at(0))


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("backward") / "everyday"
    write_recording(Synthesiser(Synthesis("everyday", frames=FRAMES, model="skin")), path)
    return path


@pytest.fixture(scope="module")
def tracking(recording: Path) -> Iterator[TrackingRun]:
    sequence = open_sequence(recording)
    configuration = configure(recording, sequence, HybridConfig(), HandShape(), backward=OPTIONS)
    with TrackingRun(configuration, sequence, wrap=bad_start) as run:
        yield run


@pytest.fixture(scope="module")
def run(tracking: TrackingRun, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder, shown = tmp_path_factory.mktemp("backward-run") / "run", list[tuple[int, int]]()
    assert len(list(tracking.write(folder, progress=lambda done, total: shown.append((done, total))))) == FRAMES
    assert shown == [(done, CLEAR) for done in range(1, CLEAR + 1)]
    return folder


def test_doubtful_poses_at_the_start_are_replaced(run: Path, recording: Path) -> None:
    found, truth = Run.load(run), open_sequence(recording).ground_truth
    assert truth is not None
    assert truth.poses is not None
    assert np.linalg.norm(found.poses[:, :3] - truth.poses[:, :3], axis=1).max() < 0.005
    assert found.status == (Status.STARTED,) + (Status.TRACKED,) * (FRAMES - 1)
    assert (np.diff(found.timestamps) > 0).all()
    assert (found.stage_ms["backward"] > 0).tolist() == [True] * CLEAR + [False] * (FRAMES - CLEAR)


def test_the_forward_poses_are_kept_beside_them(run: Path) -> None:
    lines = [(run / name).read_text().splitlines() for name in ("forward.csv", "poses.csv")]
    assert [before == after for before, after in zip(*lines, strict=True)] == (
        [True] + [False] * CLEAR + [True] * (FRAMES - CLEAR)
    )


def test_a_replay_segments_frames_of_the_backward_pass_around_their_poses(
    run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replay, guided = Replay.open(Run.load(run)), list[Array | None]()

    def spy(frame: Frame, segmenter: Segmenter, model: HandModel, guide: Guide, *others: Any) -> Any:
        guided.append(guide.predicted_pose(frame.timestamp))
        return segment(frame, segmenter, model, guide, *others)

    monkeypatch.setattr(pipeline, "segment", spy)
    assert len(list(replay)) == FRAMES
    own = [pose is not None and np.array_equal(pose, row) for pose, row in zip(guided, replay.run.poses, strict=True)]
    assert own == [True] * CLEAR + [False] * (FRAMES - CLEAR)


@pytest.mark.parametrize("kept", ["frames", "forward"])
def test_an_interrupted_run_ends_with_the_same_poses(
    kept: str, run: Path, tracking: TrackingRun, tmp_path: Path
) -> None:
    folder = _copied(run, tmp_path / "run")
    forward = (folder / "forward.csv").read_text()
    if kept == "frames":  # killed before the backward pass
        (folder / "forward.csv").unlink()
    (folder / "poses.csv").write_text(forward)
    list(tracking.write(folder, resume=True))
    assert (folder / "poses.csv").read_bytes() == (run / "poses.csv").read_bytes()
    assert (folder / "branches.csv").read_bytes() == (run / "branches.csv").read_bytes()


def test_a_complete_run_is_left_as_it_is(run: Path, tracking: TrackingRun) -> None:
    before = {file.name: file.read_bytes() for file in run.iterdir()}
    assert list(tracking.write(run, resume=True)) == []
    assert {file.name: file.read_bytes() for file in run.iterdir()} == before


def test_run_json_holds_the_options(run: Path) -> None:
    assert RunConfiguration.load(run).backward == OPTIONS
    fields = Run.load(run).configuration
    assert RunConfiguration.from_fields({**fields, "backward": None}, "run.json").backward is None
    with pytest.raises(InputError, match="gain must be"):
        RunConfiguration.from_fields({**fields, "backward": {"gain": -1}}, "run.json")


def test_a_failure_in_the_backward_pass_is_listed_and_keeps_the_forward_pose(
    recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(guided_segmentation, "failure_text", failure_text)

    class Failing(BadStart):
        def track(self, observation: Observation) -> Estimate:
            if round(30 * observation.timestamp) == -10:
                raise ZeroDivisionError("no such pose")
            return super().track(observation)

    sequence = open_sequence(recording)
    configuration = configure(recording, sequence, HybridConfig(), HandShape(), backward=OPTIONS)
    with TrackingRun(configuration, sequence, wrap=lambda tracker: Failing(tracker, pose_at(0))) as tracking:
        list(tracking.write(tmp_path / "run"))
    found = Run.load(tmp_path / "run")
    assert list(found.failures) == [10]
    assert found.failures[10].startswith("backward pass: ZeroDivisionError")
    assert 10 not in found.backward
    assert found.poses[10] == pytest.approx(pose_at(0))


def _copied(run: Path, folder: Path) -> Path:
    folder.mkdir()
    for file in run.iterdir():
        (folder / file.name).write_bytes(file.read_bytes())
    return folder


@pytest.mark.parametrize(("name", "lines"), [("timings.csv", 10), ("poses.csv", 21), ("forward.csv", 1)])
def test_a_revised_run_with_a_shortened_table_ends_with_the_same_poses(
    name: str, lines: int, run: Path, tracking: TrackingRun, tmp_path: Path
) -> None:
    folder = _copied(run, tmp_path / "run")
    if name == "timings.csv":  # killed before the poses were replaced
        (folder / "poses.csv").write_bytes((folder / "forward.csv").read_bytes())
    (folder / name).write_text("".join((folder / name).read_text().splitlines(keepends=True)[:lines]))
    with TrackingRun(tracking.configuration, tracking.sequence, wrap=bad_start) as fresh:
        list(fresh.write(folder, resume=True))
    assert (folder / "poses.csv").read_bytes() == (run / "poses.csv").read_bytes()
    assert Run.load(folder).backward == frozenset(range(CLEAR))


@pytest.mark.parametrize("name", ["timings.csv", "branches.csv"])
def test_a_revised_run_without_a_table_is_refused(name: str, run: Path, tracking: TrackingRun, tmp_path: Path) -> None:
    folder = _copied(run, tmp_path / "run")
    (folder / name).unlink()
    with pytest.raises(InputError, match=f"{name} is missing"):
        list(tracking.write(folder, resume=True))
    assert not (folder / name).exists()


def test_a_revised_run_that_is_not_whole_goes_on_from_its_forward_poses(run: Path, tmp_path: Path) -> None:
    folder = _copied(run, tmp_path / "run")
    configuration = Run.load(folder).configuration
    stages = tuple(Run.load(folder).stage_ms)
    with RunWriter(folder, configuration, stages, resume=True, length=FRAMES) as writer:
        assert writer.revised
    forward = (folder / "forward.csv").read_bytes()
    with RunWriter(folder, configuration, stages, resume=True, length=FRAMES + 10) as writer:
        assert not writer.revised
    assert (folder / "poses.csv").read_bytes() == forward


def test_a_lost_frame_among_better_forward_ones_takes_the_backward_pose() -> None:
    lost = estimate(0.9, 15.0, Status.LOST)
    good, fair = estimate(0.4, 8.0), estimate(0.4, 12.0)
    forward = [estimate(0.9), good, lost, good, estimate(0.9)]
    found = {1: fair, 2: fair, 3: fair}

    class Backwards:
        def step(self, frame: Frame, known: Estimate | None) -> Any:
            return SimpleNamespace(estimate=known or found[frame.index], failure="wrong" if frame.index == 3 else None)

    def read(places: Sequence[int]) -> list[Frame]:
        return [Frame(place, 0.0, np.zeros((1, 1), np.float32), None, CAMERA) for place in places]

    better, frames = track_backwards(forward, read, Backwards, place, CLAMP, OPTIONS)  # type: ignore[arg-type]
    assert list(better) == [2]
    assert {place: each.failure for place, each in sorted(frames.items())} == {1: None, 2: None, 3: "wrong"}
