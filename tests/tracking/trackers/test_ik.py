"""The IK tracker: accuracy on skin and cylinders, initialisation, and resuming."""

from dataclasses import replace

import numpy as np
import pytest

from depthtrack.errors import InputError
from depthtrack.evaluation.metrics import angle_error, endpoint_error
from depthtrack.hand.kinematics import HandModel
from depthtrack.hand.pose import ANGLES
from depthtrack.hand.shape import HandShape
from depthtrack.hand.synergies import Synergies
from depthtrack.recording.status import Status
from depthtrack.rendering.options import ScoringOptions
from depthtrack.solver.options import SurfaceFitOptions, SurfaceName
from depthtrack.synthesis.generate import Synthesis, Synthesiser
from depthtrack.tracking.configuration import IkConfig
from depthtrack.tracking.frame import Toolkit
from depthtrack.tracking.registry import create_tracker, tracker_config
from depthtrack.tracking.stage_tracker import StageTracker
from depthtrack.tracking.stages.coarse_to_fine import DIRECT, CoarseToFine, estimate_single_frame
from depthtrack.tracking.tracker import Estimate
from tests.support.observations import observe

MODEL = HandModel(HandShape())


@pytest.fixture(scope="module")
def made(everyday_skin: Synthesiser) -> Synthesiser:
    return everyday_skin


def follow(made: Synthesiser, tracker: StageTracker, frames: range) -> list[Estimate]:
    first, *rest = frames
    return [tracker.start(observe(made, first), made.poses[first])] + [tracker.track(observe(made, i)) for i in rest]


@pytest.mark.parametrize(("model", "highest_mm", "highest_deg"), [("skin", 2.0, 2.0), ("cylinders", 5.0, 6.0)])
def test_tracks_everyday_motion_rendered_from_the_skin(
    made: Synthesiser, model: SurfaceName, highest_mm: float, highest_deg: float
) -> None:
    """Five ICP iterations on a third of the points, as Schroeder et al. 2014 measure."""
    frames = range(100, 140)
    estimates = follow(made, create_tracker(tracker_config("ik", surface=model), made.options.hand), frames)
    poses, truth = np.array([estimate.pose for estimate in estimates]), made.poses[frames.start : frames.stop]
    assert endpoint_error(MODEL, poses, MODEL, truth).values.mean() < highest_mm
    assert angle_error(poses, truth).values.mean() < highest_deg
    assert {estimate.status for estimate in estimates[1:]} == {Status.TRACKED}


@pytest.mark.parametrize("frame", [10, 150, 270])
def test_initialises_without_a_pose(made: Synthesiser, frame: int) -> None:
    estimate = create_tracker(IkConfig(), made.options.hand).track(observe(made, frame))
    assert estimate.status is Status.STARTED
    assert estimate.pose is not None
    assert endpoint_error(MODEL, estimate.pose[None], MODEL, made.poses[[frame]]).values[0] < 10


def test_reinitialises_after_a_cut(made: Synthesiser) -> None:
    """The view changes from the palm to the back of the hand."""
    tracker = create_tracker(IkConfig(), made.options.hand)
    tracker.start(observe(made, 30), made.poses[30])
    after = [tracker.track(observe(made, frame)) for frame in (92, 93, 94)]
    assert after[-1].pose is not None
    assert endpoint_error(MODEL, after[-1].pose[None], MODEL, made.poses[[94]]).values[0] < 10
    assert Status.STARTED in {estimate.status for estimate in after}


def test_an_edge_on_hand_under_sensor_noise_stays_tracked() -> None:
    made = Synthesiser(Synthesis(model="skin", sensor="kinect1"))
    tracker = create_tracker(IkConfig(), made.options.hand)
    tracker.start(observe(made, 74), made.poses[74])
    assert {tracker.track(observe(made, frame)).status for frame in range(75, 86)} == {Status.TRACKED}


@pytest.mark.parametrize("model", ["skin", "cylinders"])
@pytest.mark.parametrize("readings", [0, 1, 5])
def test_a_frame_with_few_readings_is_lost_and_the_next_one_is_started(
    made: Synthesiser, model: SurfaceName, readings: int
) -> None:
    seen, tracker = observe(made, 0), create_tracker(tracker_config("ik", surface=model), made.options.hand)
    depth = np.zeros_like(seen.depth)
    some = np.flatnonzero(seen.depth)[:readings]
    depth.flat[some] = seen.depth.flat[some]
    tracker.start(seen, made.poses[0])
    assert tracker.track(replace(seen, depth=depth)).status is Status.LOST
    assert tracker.track(observe(made, 1)).status is Status.STARTED


def test_synergies_reduce_the_errors_of_hidden_fingers() -> None:
    """The camera is behind a grasp, and the synergies are fitted to other grasps."""
    made = Synthesiser(Synthesis(motion="grasp", model="skin"))
    synergies = _synergies_of("other-grasps")
    synergies = synergies.truncated(synergies.components_for(0.99))
    frames = range(160, 280, 2)

    def mean_error(used: Synergies | None = None, **options: bool) -> float:
        never_lost = {"thresholds.agreement": 0.0, "thresholds.energy": np.inf}
        config = tracker_config("ik", **never_lost, **({} if used is None else {"synergies": "leap"}), **options)
        tracker = create_tracker(config, made.options.hand, synergies=used)
        poses = [tracker.start(observe(made, frames[0]), made.poses[frames[0]]).pose]
        poses += [tracker.track(observe(made, frame)).pose for frame in frames[1:]]
        return float(angle_error(np.array(poses), made.poses[frames]).values.mean())

    free = mean_error()
    assert mean_error(synergies) < 0.7 * free
    assert mean_error(synergies, synergy_prior=True) < 0.6 * free


def test_coarse_to_fine_synergies_estimate_a_sign_from_one_frame() -> None:
    made = Synthesiser(Synthesis(motion="signs", model="skin"))
    synergies, frames = _synergies_of("signs"), [16, 108, 330]

    def errors(coarse_to_fine: CoarseToFine) -> np.ndarray:
        tools, fit = Toolkit(made.options.hand, ScoringOptions(), synergies=synergies), SurfaceFitOptions(subsample=1)
        poses = [
            estimate_single_frame(tools, observe(made, frame), made.poses[frame], coarse_to_fine, fit).pose
            for frame in frames
        ]
        return angle_error(np.array(poses), made.poses[frames]).values

    assert errors(CoarseToFine()).max() < 1
    assert errors(DIRECT).mean() > 3


def _synergies_of(motion: str) -> Synergies:
    return Synergies.fit(Synthesiser(Synthesis(motion=motion)).poses[:, ANGLES])


def test_a_restored_tracker_returns_the_same_bits(made: Synthesiser) -> None:
    whole = follow(made, create_tracker(IkConfig(), made.options.hand), range(0, 8))
    resumed = create_tracker(IkConfig(), made.options.hand)
    resumed.restore(whole[:5])
    for index in range(5, 8):
        np.testing.assert_array_equal(resumed.track(observe(made, index)).pose, whole[index].pose)


def test_trackers_are_made_by_name(made: Synthesiser) -> None:
    assert create_tracker(tracker_config("ik", subsample=5), made.options.hand).name == "ik"
    assert create_tracker(tracker_config("pso", particles=8), made.options.hand).name == "pso"
    with pytest.raises(InputError, match="choose one of hybrid, pso, ik"):
        tracker_config("magic")
    with pytest.raises(InputError, match="'point', 'plane' or 'symmetric'"):
        tracker_config("ik", residual="magic")
    with pytest.raises(InputError, match="particles"):
        tracker_config("ik", particles=8)
