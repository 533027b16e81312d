"""Side and sizes of a hand measured while it is tracked."""

import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

from depthtrack.calibration import ongoing_pipeline
from depthtrack.calibration.ongoing import KeptViews, OngoingSizes, first_scale, measure
from depthtrack.calibration.ongoing_pipeline import OngoingPipeline
from depthtrack.calibration.options import OngoingOptions
from depthtrack.errors import InputError
from depthtrack.hand.shape import HandShape, Side
from depthtrack.hand.size_parameters import COUNT, hand_of
from depthtrack.recording.sequence import Frame
from depthtrack.recording.status import Status
from depthtrack.segmentation.observation import Observation
from depthtrack.synthesis.generate import Synthesiser
from depthtrack.tracking.configuration import IkConfig
from depthtrack.tracking.pipeline import TrackedFrame
from depthtrack.tracking.registry import create_tracker
from depthtrack.tracking.stretches import TrackedView
from depthtrack.tracking.tracker import Estimate
from tests.support.observations import observe
from tests.support.synthesis import synthesiser

STEP = 0.125
"""Seconds between two frames: a binary fraction, so that sums are exact."""
OPTIONS = OngoingOptions(
    first_scales=(), begin=1.0, period=1.0, view_period=0.25, views=64, longest_step=STEP, sure_after=4.0
)
SCALE = 0.9


@pytest.fixture(scope="module")
def made() -> Synthesiser:
    """A small hand with a skin, and an ideal sensor."""
    return synthesiser(model="skin", hand=HandShape(scale=SCALE))


@pytest.fixture(scope="module")
def observation(made: Synthesiser) -> Observation:
    return observe(made, 0)


def sizes(scale: float, side: Side = "right") -> OngoingSizes:
    values = np.zeros(COUNT)
    values[0] = np.log(scale)
    return OngoingSizes(values, hand_of(values, side), {})


def smaller(views: Sequence[TrackedView], before: OngoingSizes, options: OngoingOptions) -> OngoingSizes:
    """Measure a hand smaller by a tenth."""
    return sizes(before.hand.scale * 0.9, before.hand.side)


@dataclass
class ScriptedTracker:
    """Tracker whose energy is given for each side, and which records what it restored."""

    hand: HandShape
    energies: dict[Side, Callable[[float], float]]
    restored: list[Estimate] = field(default_factory=list)
    tracked: list[float] = field(default_factory=list)
    closed: bool = False
    name: str = "scripted"
    stages: tuple[str, ...] = ()

    def track(self, observation: Observation) -> Estimate:
        time = observation.timestamp
        self.tracked.append(time)
        pose = np.array([0, 0, 0.5 + time, 1, *np.zeros(23)], dtype=np.float64)
        return Estimate(pose, self.energies[self.hand.side](time), 0.9, Status.TRACKED, {}, time)

    def start(self, observation: Observation, pose: ArrayLike | None = None) -> Estimate:
        return self.track(observation)

    def restore(self, estimates: Sequence[Estimate]) -> None:
        self.restored.extend(estimates)

    def predicted_pose(self, timestamp: float) -> None:
        return None

    def doubted_pose(self, timestamp: float) -> None:
        return None

    def close(self) -> None:
        self.closed = True


@dataclass
class Scene:
    """Pipeline of scripted trackers, with all trackers that it made."""

    observation: Observation
    energies: dict[Side, Callable[[float], float]]
    trackers: list[ScriptedTracker] = field(default_factory=list)
    options: OngoingOptions = OPTIONS

    def make(self, hand: HandShape) -> ScriptedTracker:
        self.trackers.append(ScriptedTracker(hand, self.energies))
        return self.trackers[-1]

    def segment(self, frame: Frame, prior: object = None) -> Observation:
        return replace(self.observation, timestamp=frame.timestamp, frame_index=frame.index)

    def alternatives(self, frame: Frame, first: Observation) -> tuple[Observation, ...]:
        return ()

    def set_lost(self, lost: bool, timestamp: float) -> None: ...

    def frames(self, seconds: float) -> Iterator[Frame]:
        for n in range(round(seconds / STEP)):
            yield Frame(n, n * STEP, np.zeros((1, 1), np.float32), None, self.observation.camera)

    def run(self, seconds: float) -> tuple[OngoingPipeline, list[Estimate]]:
        segmenter: Any = self
        with OngoingPipeline(self.make, lambda _: segmenter, options=self.options) as pipeline:
            return pipeline, [pipeline.step(frame).estimate for frame in self.frames(seconds)]


@pytest.fixture
def measured_scales(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The scales that measurements of a hand smaller by a tenth started from."""
    scales: list[float] = []

    def recorded(views: Sequence[TrackedView], before: OngoingSizes, options: OngoingOptions) -> OngoingSizes:
        scales.append(before.hand.scale)
        return smaller(views, before, options)

    monkeypatch.setattr(ongoing_pipeline, "measure", recorded)
    monkeypatch.setattr(ongoing_pipeline, "make_surface", lambda name, hand: None)
    return scales


def even(time: float) -> float:
    return 10.0


def test_views_are_bounded_and_spread_evenly(observation: Observation) -> None:
    kept, options = KeptViews(replace(OPTIONS, views=8)), replace(OPTIONS, views=8)
    frame = Frame(0, 0.0, np.zeros((1, 1), np.float32), None, observation.camera)
    assert observation.points.size > 0
    for n in range(200):
        time = n * STEP
        estimate = Estimate(np.zeros(27), 1.0, 0.9, Status.TRACKED, {}, time)
        kept.add(TrackedFrame(frame, replace(observation, timestamp=time), estimate, 0.0), time)
        assert len(kept.views) < options.views
    times = np.diff([each.observation.timestamp for each in kept.views])
    assert len(times) >= options.views // 2 - 1
    np.testing.assert_allclose(times, 4.0)
    assert all("_clouds" not in vars(each.observation) for each in kept.views)


@pytest.mark.parametrize("status", [Status.LOST, Status.ABSENT])
def test_only_trusted_poses_are_kept(observation: Observation, status: Status) -> None:
    kept, frame = KeptViews(OPTIONS), Frame(0, 0.0, np.zeros((1, 1), np.float32), None, observation.camera)
    kept.add(TrackedFrame(frame, observation, Estimate(np.zeros(27), 1.0, 0.9, status), 0.0), 0.0)
    assert kept.views == ()


def test_a_hand_is_measured_with_its_uncertainty(made: Synthesiser) -> None:
    views = [TrackedView(observe(made, n), made[n].pose, 1.0, 0.9) for n in range(0, 360, 60)]
    found = measure(views, OngoingSizes.scaled("right"), OngoingOptions())
    length = found.measured["hand_length"]
    true = OngoingSizes.scaled("right").hand.with_(scale=SCALE)
    assert length.mm == pytest.approx(
        1000 * SCALE * (true.palm_length / 2 + true.bases[2, 1] + true.lengths[2].sum()), rel=0.02
    )
    assert 0 < length.sigma_mm < 8
    assert found.hand.side == "right"
    with pytest.raises(InputError, match="at least 3 views"):
        measure(views[:2], OngoingSizes.scaled("right"), OngoingOptions())
    with pytest.raises(InputError, match="does not resemble a hand"):
        measure([each._replace(agreement=0.2) for each in views], OngoingSizes.scaled("right"), OngoingOptions())


def test_measurements_are_used_at_fixed_times_and_no_frame_is_lost(
    observation: Observation, measured_scales: list[float]
) -> None:
    scene = Scene(observation, {"right": even, "left": even})
    _, estimates = scene.run(4.5)
    hands = [each.hand for each in estimates]
    scales = [each.scale for each in hands if each is not None]
    assert len(scales) == len(estimates)
    changes = [n for n in range(1, len(scales)) if scales[n] != scales[n - 1]]
    # The first frame adds no time, and a hand is used from the next frame on.
    assert [STEP * (n - 1) for n in changes] == [2.0, 3.0, 4.0]
    np.testing.assert_allclose([scales[n] for n in [0, *changes]], [1.0, 0.9, 0.81, 0.729])
    assert all(each.pose is not None and each.status is Status.TRACKED for each in estimates)
    right = [each for each in scene.trackers if each.hand.side == "right"]
    assert [time for each in right for time in each.tracked] == [n * STEP for n in range(len(estimates))]
    for before, after in pairwise(right):
        assert before.closed
        assert [each.timestamp for each in after.restored] == before.tracked[-2:]


def test_the_size_of_the_whole_hand_is_used_before_the_first_measurement(
    observation: Observation, measured_scales: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    compared = list[tuple[Side, int]]()

    def first(views: Sequence[TrackedView], side: Side, make: object, options: OngoingOptions) -> float:
        compared.append((side, len(views)))
        return 0.8

    monkeypatch.setattr(ongoing_pipeline, "first_scale", first)
    options = replace(OPTIONS, first_scales=(0.8, 0.9, 1.0), scale_begin=0.5)
    scene = Scene(observation, {"right": even, "left": even}, options=options)
    _, estimates = scene.run(2.5)
    scales = [each.hand.scale for each in estimates if each.hand is not None]
    changes = [n for n in range(1, len(scales)) if scales[n] != scales[n - 1]]
    assert [STEP * (n - 1) for n in changes] == [1.0, 2.0]
    np.testing.assert_allclose([scales[n] for n in [0, *changes]], [1.0, 0.8, 0.72])
    # One side is compared, and the other hand has the same size.
    assert compared == [("right", 2)]
    np.testing.assert_allclose(measured_scales[:2], 0.8)


def test_the_size_of_the_whole_hand_fits_views_best(made: Synthesiser) -> None:
    views = [TrackedView(observe(made, n), made[n].pose, 1.0, 0.9) for n in range(0, 100, 20)]
    make = partial(create_tracker, IkConfig())
    found = first_scale(views, "right", make, OngoingOptions())
    assert found == pytest.approx(SCALE, rel=0.03)
    with pytest.raises(InputError, match="at least 3 views"):
        first_scale(views[:2], "right", make, OngoingOptions())


def test_the_next_measurements_are_rarer_when_the_hand_stays(
    observation: Observation, monkeypatch: pytest.MonkeyPatch
) -> None:
    latest = list[float]()

    def same(views: Sequence[TrackedView], before: OngoingSizes, options: OngoingOptions) -> OngoingSizes:
        if before.hand.side == "right":
            latest.append(views[-1].observation.timestamp)
        return before

    monkeypatch.setattr(ongoing_pipeline, "measure", same)
    monkeypatch.setattr(ongoing_pipeline, "make_surface", lambda name, hand: None)
    pipeline, _ = Scene(observation, {"right": even, "left": even}).run(17.5)
    # The last one, begun at 16 s, may be cancelled.
    np.testing.assert_allclose(latest[:4], [1.0, 2.0, 4.0, 8.0], atol=0.5)
    assert len(latest) <= 5
    assert pipeline.hand == HandShape()


def test_a_slow_measurement_changes_no_estimate(
    observation: Observation, measured_scales: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first measurement does not end before the frame that needs it waits."""
    scene = Scene(observation, {"right": even, "left": even})
    quick = [each.hand for each in scene.run(3.0)[1]]
    waiting = threading.Event()

    def slow(views: Sequence[TrackedView], before: OngoingSizes, options: OngoingOptions) -> OngoingSizes:
        assert waiting.wait(60)
        return smaller(views, before, options)

    take = OngoingPipeline._use_measurement

    def use(pipeline: OngoingPipeline) -> None:
        if pipeline._pending is not None:
            assert not pipeline._pending.done()
            waiting.set()
        take(pipeline)

    monkeypatch.setattr(ongoing_pipeline, "measure", slow)
    monkeypatch.setattr(OngoingPipeline, "_use_measurement", use)
    assert [each.hand for each in Scene(observation, scene.energies).run(3.0)[1]] == quick


def test_frames_with_a_deadline_do_not_wait(
    observation: Observation, measured_scales: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first measurement is due at two seconds, and ends after the frame of three."""
    scene, finished = Scene(observation, {"right": even, "left": even}), threading.Event()

    def slow(views: Sequence[TrackedView], before: OngoingSizes, options: OngoingOptions) -> OngoingSizes:
        assert finished.wait(60)
        return smaller(views, before, options)

    monkeypatch.setattr(ongoing_pipeline, "measure", slow)
    segmenter: Any = scene
    scales = list[float]()
    with OngoingPipeline(scene.make, lambda _: segmenter, options=OPTIONS, waits=False) as pipeline:
        for frame in scene.frames(3.5):
            if frame.timestamp == 3.0:
                finished.set()
                assert pipeline._pending is not None
                pipeline._pending.result()
            pipeline.step(frame)
            scales.append(pipeline.hand.scale)
    changed = scales.index(0.9)
    assert changed * STEP == 3.0
    assert scales == [1.0] * changed + [0.9] * (len(scales) - changed)


def test_a_failed_measurement_keeps_the_hand(observation: Observation, monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(*arguments: object) -> OngoingSizes:
        raise InputError("too few views")

    monkeypatch.setattr(ongoing_pipeline, "measure", failing)
    pipeline, estimates = Scene(observation, {"right": even, "left": even}).run(5.0)
    assert {each.hand for each in estimates} == {HandShape()}
    assert pipeline.measured == {}


def test_the_side_of_the_lower_energy_leads_and_the_other_is_given_up(
    observation: Observation, measured_scales: list[float]
) -> None:
    """From two seconds on, the fingers of a right hand have to bend backwards."""
    scene = Scene(observation, {"right": lambda time: 10.0 if time < 2 else 30.0, "left": lambda time: 10.5})
    pipeline, estimates = scene.run(6.0)
    sides = [each.hand.side for each in estimates if each.hand is not None]
    first = sides.index("left")
    assert sides == ["right"] * first + ["left"] * (len(sides) - first)
    assert 2.0 <= first * STEP < 3.0
    assert pipeline.side_sure
    assert pipeline.hand.side == "left"
    right = [each for each in scene.trackers if each.hand.side == "right"]
    assert all(each.closed for each in right)
    assert max(right[-1].tracked) == 4.0


def test_sides_that_fit_alike_are_both_carried_on(observation: Observation, measured_scales: list[float]) -> None:
    pipeline, estimates = Scene(observation, {"right": lambda time: 10.5, "left": even}).run(9.0)
    assert not pipeline.side_sure
    assert {each.hand.side for each in estimates if each.hand is not None} == {"right"}
