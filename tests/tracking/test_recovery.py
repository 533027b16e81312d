"""Recovery from shifted fingers and losses, and proposals within anatomical limits."""

from contextlib import closing
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from depthtrack.evaluation.metrics import endpoint_error
from depthtrack.geometry.rotations import quaternion_log, quaternion_product, rotation_matrix
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.pose import ANGLES, ORIENTATION, POSITION
from depthtrack.hand.postures import POSTURES
from depthtrack.hand.shape import HandShape
from depthtrack.recording.status import Status
from depthtrack.rendering.raster import RasterScorer
from depthtrack.rendering.scorer import Scores
from depthtrack.solver.options import SwarmOptions
from depthtrack.synthesis.generate import Synthesiser
from depthtrack.tracking.candidate import Candidate, evaluate
from depthtrack.tracking.configuration import HybridConfig, PsoConfig
from depthtrack.tracking.frame import FrameContext, Toolkit
from depthtrack.tracking.options import (
    FingerOptions,
    GlobalSearchOptions,
    RecoveryOptions,
    SwarmSearchOptions,
    TrackingThresholds,
)
from depthtrack.tracking.proposals.fingers import finger_shift_proposals, search_one_finger
from depthtrack.tracking.proposals.global_ import distinct_orientations, orientation_proposals, typical_angles
from depthtrack.tracking.proposals.local import local_proposals
from depthtrack.tracking.registry import create_tracker, tracker_config
from depthtrack.tracking.stages import recover
from depthtrack.tracking.stages.searches import SwarmSearch, search_globally, swarm_search
from depthtrack.tracking.stages.stage import Stage
from depthtrack.tracking.stages.swarm import swarm_around
from depthtrack.tracking.state import TrackState
from tests.support.observations import observe

MODEL = HandModel(HandShape())


@pytest.fixture(scope="module")
def made(everyday_skin: Synthesiser) -> Synthesiser:
    return everyday_skin


def _shifted(made: Synthesiser, pose: np.ndarray) -> np.ndarray:
    """Return a pose with the palm shifted by one finger and the middle finger folded."""
    wrong = pose.copy()
    towards_thumb = rotation_matrix(pose[3:7])[:, 0] * made.options.hand.mirror
    wrong[POSITION] += 0.02 * towards_thumb
    wrong[ANGLES] = POSTURES["open"]
    wrong[ANGLES][8:12] = POSTURES["fist"][8:12]
    return wrong


def test_recovery_leaves_a_local_minimum_of_the_swarm(made: Synthesiser) -> None:
    """A swarm of the same spread stays at the pose shifted by one finger."""
    errors = []
    for frame in (11, 17, 23):
        wrong = _shifted(made, made.poses[frame])
        with RasterScorer(made.options.hand) as scorer:
            scorer.set_target(observe(made, frame).reduced(96))
            swarm = SwarmOptions(64, 25, inertia=0.6, near_best=0.5)
            stayed = swarm_around(scorer, wrong, PsoConfig().spread, swarm, np.random.default_rng(5)).pose
            generator = np.random.default_rng(5)
            starts = evaluate(scorer, local_proposals(wrong, generator, RecoveryOptions()))
            found = swarm_search(scorer, starts, generator, SwarmSearchOptions(), 0.1)[0].pose
        errors.append(endpoint_error(MODEL, np.stack([stayed, found]), MODEL, made.poses[[frame, frame]]).values)
    stayed_error, found_error = np.mean(errors, axis=0)
    assert found_error < 0.7 * stayed_error


def test_local_proposals_are_admissible_and_near(made: Synthesiser) -> None:
    poses = local_proposals(made.poses[20], np.random.default_rng(1), RecoveryOptions(proposals=500))
    angles = poses[:, ANGLES]
    assert ((angles >= LOWER - 1e-12) & (angles <= UPPER + 1e-12)).all()
    assert np.linalg.norm(poses[:, POSITION] - made.poses[20, POSITION], axis=1).max() < 0.12
    # Some proposals keep the fingers up to noise, and others change all of them.
    change = np.abs(angles - made.poses[20, ANGLES]).max(axis=1)
    assert change.min() < 0.4
    assert np.median(change) > 0.6


def test_orientations_outside_the_wrist_limits_are_excluded() -> None:
    arm, angles = np.array([0.0, 0.6, 0.8]), typical_angles(np.random.default_rng(3), 400)
    poses = orientation_proposals(np.array([0, 0, 0.5]), angles, np.random.default_rng(2), arm)
    towards_wrist = -rotation_matrix(poses[:, 3:7])[:, :, 1]
    assert (towards_wrist @ arm > 0.15).all()
    free = orientation_proposals(np.array([0, 0, 0.5]), angles, np.random.default_rng(2))
    assert (rotation_matrix(free[:, 3:7])[:, :, 1] @ arm > 0.15).any()


def test_the_search_of_one_finger_corrects_it(made: Synthesiser) -> None:
    """Each finger in turn is bent or stretched. The search corrects it and moves no other."""
    frame = 11
    o, truth = observe(made, frame), made.poses[frame]
    with RasterScorer(made.options.hand) as scorer:
        scorer.set_target(o)
        for finger in range(1, 5):
            wrong, angles = truth.copy(), slice(7 + 4 * finger, 11 + 4 * finger)
            straight = truth[angles][1:].sum() < np.radians(90)
            wrong[angles] = POSTURES["fist" if straight else "open"][4 * finger : 4 * finger + 4]
            best = search_one_finger(scorer, wrong, finger, np.random.default_rng(finger), FingerOptions())
            found = best.pose
            assert best.energy == scorer.score(found[None])[0]
            before, after = endpoint_error(MODEL, np.stack([wrong, found]), MODEL, np.stack([truth, truth])).values
            assert after < 0.4 * before
            assert np.array_equal(np.delete(found, np.r_[angles]), np.delete(wrong, np.r_[angles]))


def test_opposite_finger_shifts_cancel(made: Synthesiser) -> None:
    """Opposite shifts by one finger restore three of the four fingers."""
    truth = made.poses[11].copy()
    truth[ANGLES] = POSTURES["open"]
    for way in (0, 1):
        shifted = finger_shift_proposals(MODEL, truth)[way]
        assert not np.allclose(shifted, truth)
        back = finger_shift_proposals(MODEL, shifted)[1 - way]
        there, here = (MODEL.endpoints(pose).reshape(5, 4, 3) for pose in (truth, back))
        distances = np.linalg.norm(there - here, axis=-1)[1:, 3]
        assert np.sort(distances)[2] < 0.015
        assert np.linalg.norm(there - MODEL.endpoints(shifted).reshape(5, 4, 3), axis=-1)[1:, 3].min() > 0.015


@pytest.mark.parametrize(("frames", "kept"), [(15, True), (16, False)])
def test_the_last_trusted_pose_is_kept_for_half_a_second(made: Synthesiser, frames: int, kept: bool) -> None:
    state, pose = TrackState(TrackingThresholds(), 40.0), made.poses[0]
    state.commit(pose, 5.0, 0.9, Status.TRACKED, {}, 0.0)
    for index in range(1, frames + 1):
        lost = state.commit(made.poses[50], 90.0, 0.1, Status.TRACKED, {}, index / 30)
        assert lost.status is Status.LOST
        assert state.pose is None
    assert (state.last_trusted is pose) == kept


def test_an_energy_is_elevated_above_the_median_of_the_track(made: Synthesiser) -> None:
    state = TrackState(TrackingThresholds(), 40.0)
    assert state.is_elevated(1.0, 0)
    assert not state.is_elevated(1000.0, 1.1)
    for energy in (9.0, 10.0, 14.0):
        state.commit(made.poses[0], energy, 0.9, Status.TRACKED, {})
    assert [state.is_elevated(energy, 1.1) for energy in (10.9, 11.1)] == [False, True]
    state.forget_last()
    assert not state.is_elevated(1000.0, 1.1)


@pytest.mark.parametrize(("turns", "searched"), [(1, [5, 5, 5, 5]), (2, [3, 2, 3, 2]), (6, [1, 1, 1, 1])])
def test_fingers_take_turns(
    made: Synthesiser, turns: int, searched: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """In six frames, each finger is searched equally often."""
    fingers: list[int] = []

    def search(scorer: RasterScorer, pose: np.ndarray, finger: int, *_: object) -> Candidate:
        fingers.append(finger)
        return Candidate(pose, np.inf, 0.0)

    monkeypatch.setattr(recover, "search_one_finger", search)
    config, tools = HybridConfig(), Toolkit(HandShape(), HybridConfig().scoring)
    options = FingerOptions(turns=turns, usual_turns=1)
    stage = recover.RefineFingers(SwarmSearch(SwarmSearchOptions(refine=False)), RecoveryOptions(), options)
    counts = []
    for index in range(6):
        observation = observe(made, index)
        tools.set_target(observation)
        frame, before = FrameContext(observation, tools, TrackState(config.thresholds, 40.0), 0), len(fingers)
        stage(frame, [Candidate(made.poses[index], 100.0, 0.9)])
        counts.append(len(fingers) - before)
    assert counts[:4] == searched
    assert {fingers.count(finger) for finger in range(5)} == {6 // turns}


@pytest.mark.parametrize(
    ("visible", "energy", "accepted"),
    [(1.0, 97.0, True), (1.0, 99.0, False), (0.1, 97.0, False), (0.1, 81.0, False), (0.1, 79.0, True)],
)
def test_a_hidden_finger_needs_more_evidence_for_another_posture(
    made: Synthesiser, visible: float, energy: float, accepted: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = made.poses[1]
    monkeypatch.setattr(recover, "search_one_finger", lambda *_: Candidate(other, energy, 0.9))
    monkeypatch.setattr(FrameContext, "finger_visibility", lambda self, pose: np.full(5, visible))
    config, tools = HybridConfig(), Toolkit(HandShape(), HybridConfig().scoring)
    observation = observe(made, 0)
    tools.set_target(observation)
    stage = recover.RefineFingers(SwarmSearch(SwarmSearchOptions(refine=False)), RecoveryOptions(), FingerOptions())
    frame = FrameContext(observation, tools, TrackState(config.thresholds, 40.0), 0)
    found = stage(frame, [Candidate(made.poses[0], 100.0, 0.9)])[0]
    np.testing.assert_array_equal(found.pose, other if accepted else made.poses[0])


@pytest.mark.parametrize(("energy", "starts", "kept"), [(80.0, True, True), (85.0, True, False), (80.0, False, False)])
def test_a_searched_posture_stays_in_a_start_if_its_fit_is_clearly_worse(
    made: Synthesiser, energy: float, starts: bool, kept: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The fit costs 85; 0.98 of it is 83.3."""
    searched, fitted = made.poses[1], made.poses[2]
    costs = {searched.tobytes(): energy, fitted.tobytes(): 85.0}
    monkeypatch.setattr(recover, "search_one_finger", lambda *_: Candidate(searched, -1.0, 0.9))
    monkeypatch.setattr(FrameContext, "fitter", lambda *_: SimpleNamespace(fit=lambda pose, prior: fitted))
    monkeypatch.setattr(
        FrameContext, "evaluate", lambda self, poses: [Candidate(poses[0], costs[poses[0].tobytes()], 0.9)]
    )
    config, tools = HybridConfig(), Toolkit(HandShape(), HybridConfig().scoring)
    observation = observe(made, 0)
    tools.set_target(observation)
    stage = recover.RefineFingers(
        SwarmSearch(SwarmSearchOptions(refine=False)), RecoveryOptions(), FingerOptions(), config.fit
    )
    state = TrackState(config.thresholds, 40.0)
    if not starts:
        state.commit(made.poses[0], 10.0, 0.9, Status.TRACKED, {}, observation.timestamp, 0.9)
    found = stage(FrameContext(observation, tools, state, 0), [Candidate(made.poses[0], 100.0, 0.9)])[0]
    np.testing.assert_array_equal(found.pose, searched if kept else fitted)


def test_the_visibility_of_fingers_follows_the_pose(made: Synthesiser) -> None:
    config, tools = HybridConfig(), Toolkit(HandShape(), HybridConfig().scoring)
    observation = observe(made, 0)
    tools.set_target(observation)
    frame = FrameContext(observation, tools, TrackState(config.thresholds, 40.0), 0)
    pose = made.poses[0]
    np.testing.assert_array_equal(frame.finger_visibility(pose), 1)
    fist = pose.copy()
    fist[7:] = POSTURES["fist"]
    assert frame.finger_visibility(fist).min() <= 0.5


class _Repeated:
    """Search that returns the same energy again and again."""

    def __init__(self, energy: float) -> None:
        self.energy, self.calls = energy, 0

    def improve(self, frame: FrameContext, starts: list[Candidate], min_angle: float) -> list[Candidate]:
        self.calls += 1
        return [Candidate(starts[0].pose, self.energy / self.calls, 0.9)]

    def random(self, frame: FrameContext) -> np.random.Generator:
        return frame.random


def test_a_global_search_ends_at_the_usual_energy_of_the_track(made: Synthesiser) -> None:
    state, tools = TrackState(TrackingThresholds(), 40.0), Toolkit(HandShape(), HybridConfig().scoring)
    frame = FrameContext(observe(made, 20), tools, state, 0)
    tools.set_target(frame.observation)
    for known, repetitions in ((False, 3), (True, 1)):
        if known:
            state.commit(made.poses[0], 20.0, 0.9, Status.TRACKED, {})
        search = _Repeated(23.0)
        options = GlobalSearchOptions(proposals=8, good_energy=0.1, good_ratio=1.2)
        search_globally(frame, search, options)  # type: ignore[arg-type]
        assert search.calls == repetitions


def test_a_hand_that_stays_lost_is_searched_for_at_growing_intervals(made: Synthesiser) -> None:
    """Searches follow after 0.1, 0.3 and 0.7 s, and at least once in each later second."""
    state, pose = TrackState(TrackingThresholds(search_interval=0.1, longest_interval=1.0), 40.0), made.poses[0]
    state.commit(pose, 5.0, 0.9, Status.TRACKED, {}, 0.0)
    due = []
    for index in range(1, 122):
        lost = state.commit(pose, 90.0, 0.1, Status.TRACKED, {}, index / 30)
        assert lost.status is Status.LOST
        if state.is_search_due((index + 1) / 30):
            due.append(index)
    assert due[:4] == [1, 3, 9, 21]
    assert 5 <= len(due) <= 10
    assert np.diff(due).max() <= 31
    state.commit(pose, 5.0, 0.9, Status.STARTED, {}, 4.2)
    assert state.is_search_due(4.23)


@pytest.mark.parametrize(
    ("energy", "lost_energy", "seconds", "elsewhere"),
    [
        (8.0, 30.0, 0.0, False),  # the pose near the last one fits
        (20.0, 30.0, 0.0, True),  # it fits poorly
        (8.0, 8.5, 0.0, True),  # it fits as well as the lost one, which another reason made lost
        (20.0, 30.0, 0.05, False),  # the next search is not due
        (20.0, 30.0, 0.08, True),
    ],
)
def test_a_lost_hand_is_searched_for_near_its_last_pose_first(
    made: Synthesiser, energy: float, lost_energy: float, seconds: float, elsewhere: bool
) -> None:
    config, tools, state = (
        HybridConfig(),
        Toolkit(HandShape(), HybridConfig().scoring),
        TrackState(TrackingThresholds(), 40.0),
    )
    state.commit(made.poses[19], 10.0, 0.9, Status.TRACKED, {}, 0.0)
    for passed in dict.fromkeys((0.0, seconds)):
        state.commit(made.poses[50], lost_energy, 0.1, Status.TRACKED, {}, 0.03 + passed)
    observation = replace(observe(made, 20), timestamp=0.06 + seconds)
    tools.set_target(observation)
    ran = list[str]()

    def found(name: str) -> Stage:
        def stage(frame: FrameContext, candidates: list[Candidate]) -> list[Candidate]:
            ran.append(name)
            return [Candidate(made.poses[0], 7.0, 0.9)]

        stage.name = name  # type: ignore[attr-defined]
        return stage  # type: ignore[return-value]

    stage = recover.Reinitialise(
        _Repeated(energy),  # type: ignore[arg-type]
        config.recovery,
        config.search,
        fit=[],
        elsewhere=[found("elsewhere")],
        start=[found("start")],
    )
    best = stage(FrameContext(observation, tools, state, 0), [])[0]
    assert ran == ["elsewhere"] * elsewhere
    assert best.energy == (7.0 if elsewhere and energy > 10 else energy)


def test_distinct_orientations_are_those_of_the_logarithm(made: Synthesiser) -> None:
    poses = np.tile(made.poses[0], (200, 1))
    poses[:, ORIENTATION] = np.random.default_rng(4).standard_normal((200, 4))
    poses[:, ORIENTATION] /= np.linalg.norm(poses[:, ORIENTATION], axis=1, keepdims=True)
    plain: list[int] = []
    for i, pose in enumerate(poses):
        between = quaternion_log(quaternion_product(pose[ORIENTATION], poses[plain][:, ORIENTATION] * [1, -1, -1, -1]))
        if not plain or np.linalg.norm(between, axis=-1).min() >= 0.5:
            plain.append(i)
    assert 20 < len(plain) < 200
    assert distinct_orientations(poses, 0.5, 200) == plain
    assert distinct_orientations(poses, 0.5, 12) == plain[:12]


def test_a_pose_of_unusual_energy_gives_no_prediction(made: Synthesiser) -> None:
    state, pose = TrackState(TrackingThresholds(), 40.0), made.poses[0]
    for _ in range(5):
        state.commit(pose, 16.0, 0.8, Status.TRACKED, {})
        assert state.predicted_pose(0.0) is not None
    state.commit(pose, 22.0, 0.8, Status.TRACKED, {})
    assert state.pose is not None
    assert state.predicted_pose(0.0) is None
    state.commit(pose, 18.0, 0.55, Status.TRACKED, {})
    assert state.pose is not None
    assert state.predicted_pose(0.0) is None


class _Levels:
    """Scorer with the difference of one angle from a given one as energy."""

    def __init__(self, angle: float) -> None:
        self.angle, self.seen = angle, list[np.ndarray]()

    def evaluate(self, poses: np.ndarray) -> Scores:
        self.seen.append(poses.copy())
        energy = np.abs(poses[:, 13] - self.angle)
        return Scores(energy, np.ones_like(energy))


def test_several_postures_of_a_finger_are_refined(made: Synthesiser) -> None:
    scorer, options = _Levels(0.7), FingerOptions()
    search_one_finger(scorer, made.poses[0], 1, np.random.default_rng(0), options)  # type: ignore[arg-type]
    first, second = scorer.seen[0], scorer.seen[1]
    kept = first[np.argsort(np.abs(first[:, 13] - 0.7), kind="stable")[: options.kept]]
    nearest = np.argmin(np.abs(second[:, None, 13] - kept[None, :, 13]), axis=1)
    assert len(second) == options.proposals - options.kept
    assert np.all(np.abs(second[:, 13] - np.tile(kept[:, 13], 11)) < 1.0)
    assert len(set(nearest.tolist())) >= 4


@pytest.mark.parametrize("name", ["ik", "pso", "hybrid"])
def test_a_start_does_not_depend_on_earlier_frames(made: Synthesiser, name: str) -> None:
    with (
        closing(create_tracker(tracker_config(name), made.options.hand)) as fresh,
        closing(create_tracker(tracker_config(name), made.options.hand)) as used,
    ):
        used.start(observe(made, 30), made.poses[30])
        first, second = (tracker.start(observe(made, 120)) for tracker in (fresh, used))
    assert first.pose is not None
    assert first.pose.tolist() == second.pose.tolist()  # type: ignore[union-attr]


@pytest.mark.parametrize("name", ["ik", "pso", "hybrid"])
def test_a_restored_tracker_continues_after_a_loss_with_the_same_bits(made: Synthesiser, name: str) -> None:
    """One frame has only a few distant pixels: its status is lost, and the next one's started."""
    frames = [observe(made, index) for index in (20, 21, 22, 23)]
    pixels = np.zeros_like(frames[1].silhouette)
    pixels[:3, :3] = pixels[-3:, -3:] = pixels[:3, -3:] = pixels[-3:, :3] = True
    frames[1] = replace(frames[1], silhouette=pixels, depth=np.where(pixels, np.float32(0.5), np.float32(0)))
    with (
        closing(create_tracker(tracker_config(name), made.options.hand)) as whole,
        closing(create_tracker(tracker_config(name), made.options.hand)) as cut,
    ):
        estimates = [whole.start(frames[0], made.poses[20]), *(whole.track(frame) for frame in frames[1:])]
        assert [estimate.status for estimate in estimates[1:3]] == ["lost", "started"]
        cut.restore(estimates[:2])
        again = [cut.track(frame) for frame in frames[2:]]
    poses, poses_again = (np.array([estimate.pose for estimate in some]) for some in (estimates[2:], again))
    assert np.array_equal(poses, poses_again)
    assert endpoint_error(MODEL, poses, MODEL, made.poses[[22, 23]]).values.max() < 10


def test_a_pose_is_followed_for_a_time_and_not_for_a_number_of_frames(made: Synthesiser) -> None:
    thresholds = TrackingThresholds(memory=0.5, longest_gap=0.3)
    state = TrackState(thresholds, 40.0)
    for index in (0, 1):
        state.commit(made.poses[index], 5.0, 0.9, Status.TRACKED, {}, index / 30)
    step = state.motion_until(2 / 30)
    np.testing.assert_allclose(state.motion_until(4 / 30), 3 * step)
    np.testing.assert_array_equal(state.motion_until(2 / 30 + 1e-6), step)  # rounded time stamps
    assert state.predicted_pose(0.3) is not None
    assert not state.is_stale(1 / 30 + 0.3)
    assert state.is_stale(0.5)
    assert state.predicted_pose(0.5) is None
    assert not state.motion_until(0.5).any()
    for seconds, known in ((0.2, True), (0.5, True), (0.6, False)):
        state.commit(made.poses[2], 99.0, 0.1, Status.TRACKED, {}, seconds)
        assert (state.last_trusted is not None) == known


@pytest.mark.parametrize(("name", "recovers"), [("ik", 1), ("pso", 1), ("schroeder2014", 0), ("oikonomidis2011", 0)])
def test_the_papers_trackers_do_not_recover(made: Synthesiser, name: str, recovers: bool) -> None:
    """The jump of the hand triggers the recovery of the other trackers."""
    with closing(create_tracker(tracker_config(name), made.options.hand)) as tracker:
        tracker.start(observe(made, 20), made.poses[20])
        estimate = tracker.track(observe(made, 130))
    assert ("recover" in tracker.stages) == recovers
    assert (estimate.stage_ms.get("recover", 0) > 1) == recovers


def test_a_loss_is_judged_by_what_no_object_hides(made: Synthesiser) -> None:
    state, pose = TrackState(TrackingThresholds(), 40.0), made.poses[0]
    state.commit(pose, 10.0, 0.9, Status.TRACKED, {})
    seen = Candidate(pose, 15.0, 0.8)
    assert state.commit(pose, 30.0, 0.4, Status.TRACKED, {}, seen=seen).status is Status.TRACKED
    assert state.commit(pose, 30.0, 0.4, Status.TRACKED, {}).status is Status.LOST
